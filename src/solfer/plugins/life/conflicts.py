"""Joints that two plugins want to command."""

from collections.abc import Iterable
from itertools import combinations

from solfer.errors import ClaimRefused
from solfer.plugins.life.managed_plugin import ManagedPlugin


def check_claims(plugins: Iterable[ManagedPlugin]) -> None:
    """Check that no number of a joint's command is wanted by two of these plugins.

    Raises:
        ClaimRefused: It is; names both plugins, and the joint.
    """
    for one, other in combinations(plugins, 2):
        common = one.claims & other.claims
        if common:
            controller, field, joint = min(common)
            raise ClaimRefused(
                f"'{one.name}' and '{other.name}' both command the {field} of joint '{joint}' "
                f"({len(common)} numbers in common)",
                where=f"controller '{controller}'",
                expected="one of them stopped in the same switch",
            )

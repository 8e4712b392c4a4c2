"""Joints that two plugins command."""

from collections.abc import Iterable, Iterator, Set
from itertools import combinations

from solfer.errors import ClaimRefused
from solfer.plugins.outputs.outputs import Claim


def find_conflicts(claims: Iterable[tuple[str, Set[Claim], str]], expected: str) -> Iterator[ClaimRefused]:
    """Yield an error for each two plugins that command the same number of a joint.

    Args:
        claims: Name of each plugin, what it commands, and its place in a file, if it has one.
        expected: What the user can do about it.
    """
    for (one, first, _), (other, second, where) in combinations(claims, 2):
        common = first & second
        if common:
            controller, field, joint = min(common)
            yield ClaimRefused(
                f"'{one}' and '{other}' both command the {field} of joint '{joint}' ({len(common)} numbers in common)",
                where=where or f"controller '{controller}'",
                expected=expected,
            )

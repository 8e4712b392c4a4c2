"""Friction of the links that an engine has."""

from collections.abc import Mapping

from solfer.errors import SimulationError
from solfer.simulation.world.records import Friction


def coefficients(friction: Friction, owner: Mapping[str, str]) -> dict[str, float]:
    """Return the friction coefficient of each link that an engine has.

    Args:
        friction: Friction of the links of the description.
        owner: For each of these links, the link of the engine that it became part of.

    Raises:
        SimulationError: `friction` names a link that the robot does not have.
    """
    unknown = [link for link in friction.links if link not in owner]
    if unknown:
        raise SimulationError(
            f"friction of links that the robot does not have: {', '.join(unknown)}",
            expected="links that the URDF of the robot has",
        )
    given = {owner[link]: value for link, value in friction.links.items()}
    return {own: given.get(own, friction.default) for own in owner.values()}

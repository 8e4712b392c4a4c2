"""Friction coefficients of a world."""

from collections.abc import Mapping
from dataclasses import dataclass, field

DEFAULT = 0.3
GROUND = 1.0


@dataclass(frozen=True)
class Friction:
    """Coulomb friction; Bullet multiplies the coefficients of the two bodies that touch.

    Attributes:
        default: Coefficient of a link of the robot.
        links: Coefficients of links that differ.
        ground: Coefficient of the ground; None: there is no ground.
    """

    default: float = DEFAULT
    links: Mapping[str, float] = field(default_factory=dict)
    ground: float | None = GROUND

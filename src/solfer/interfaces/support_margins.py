"""What the component publishes of the support polygon."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SupportMargins:
    """A `solfer/SupportMargins`.

    Attributes:
        names: Names of the limits: `margin A-B` of the edge between two wheels, `workspace A` of a wheel.
        limits: Least margins, and largest distances of wheels from their hips [m].
        reserves: What is left of each, negative beyond it [m].
        active: The limits that change the motion.
        infeasible: Those of them that cannot be kept.
        share: Share of the desired velocities with which the motion goes on.
        reaction: Velocity with which the polygon moves under a robot that is pushed: x, y in the world [m/s].
    """

    names: tuple[str, ...] = ()
    limits: tuple[float, ...] = ()
    reserves: tuple[float, ...] = ()
    active: tuple[str, ...] = ()
    infeasible: tuple[str, ...] = ()
    share: float = 1.0
    reaction: tuple[float, ...] = (0.0, 0.0)

"""What components that stand on contacts share: lifts, margins of the support polygon, and ports of wheels."""

from dataclasses import dataclass

BASE_PORT = "base"
"""Input of the base's pose and velocity."""

VERTICES_PORT = "vertices"
"""Input of the vertices of the support polygon."""

VELOCITIES_PORT = "vertex_velocities"
"""Input of their velocities."""

LEAD = 0.5
"""Time that places are ahead of a motion which is to be followed without a lag [s]."""


@dataclass(frozen=True)
class LiftContacts:
    """Which contacts carry the robot.

    Attributes:
        contacts: Names of contacts; empty: all that are tracked.
        lifted: Whether they carry nothing from now on; else they carry again.
    """

    contacts: tuple[str, ...] = ()
    lifted: bool = True


@dataclass(frozen=True)
class StepContact:
    """A step of a wheel, to a place seen from where it is in the heading frame of the base.

    Attributes:
        contact: Name of the contact.
        ahead, left, up: To where it stands then [m].
        clearance: How far it is above both places on its way [m]; 0: 0.05.
    """

    contact: str = ""
    ahead: float = 0.0
    left: float = 0.0
    up: float = 0.0
    clearance: float = 0.0


@dataclass(frozen=True)
class LiftReply:
    """Answer to `LiftContacts` and `StepContact`: whether it is carried out, and why not."""

    success: bool = True
    message: str = ""


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

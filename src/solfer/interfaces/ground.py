"""The ground below a robot, as one component feels it and others use it."""

from dataclasses import dataclass, field

from solfer.interfaces.geometry import Header, Vector

GROUND = "solfer/Ground"
"""Interface of `GroundEstimate`."""

GROUND_FRAME = "odom"
"""Frame of a `GroundEstimate`: the world in which odometry has the base."""


@dataclass(frozen=True)
class GroundEstimate:
    """A `solfer/Ground`; lists have one element for each contact.

    Attributes:
        header: The frame is `GROUND_FRAME`.
        names: Names of the contacts.
        places: Where the ground is at them [m].
        normals: Its unit normals there.
        height_deviations: Standard deviations of the heights of places [m].
        normal_deviations: Standard deviations of the normals [rad].
        friction: Coefficients of friction that were felt, else NaN.
        point: A point of the plane under the robot as a whole [m].
        normal: Unit normal of this plane.
    """

    header: Header = field(default_factory=lambda: Header(frame_id=GROUND_FRAME))
    names: tuple[str, ...] = ()
    places: tuple[Vector, ...] = ()
    normals: tuple[Vector, ...] = ()
    height_deviations: tuple[float, ...] = ()
    normal_deviations: tuple[float, ...] = ()
    friction: tuple[float, ...] = ()
    point: Vector = field(default_factory=Vector)
    normal: Vector = field(default_factory=lambda: Vector(z=1.0))

"""Messages of geometry that components declare, with the fields of `geometry_msgs`."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Vector:
    """Three coordinates."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True)
class Twist:
    """A velocity: linear [m/s] and angular [rad/s]."""

    linear: Vector = field(default_factory=Vector)
    angular: Vector = field(default_factory=Vector)


@dataclass(frozen=True)
class Turn:
    """A quaternion."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


@dataclass(frozen=True)
class Pose:
    """A position [m] and a quaternion."""

    position: Vector = field(default_factory=Vector)
    orientation: Turn = field(default_factory=Turn)


def bare_frame(frame: str) -> str:
    """Return the name of a frame without the leading slash that some publishers still send, as for the first tf."""
    return frame.lstrip("/")


@dataclass(frozen=True)
class Header:
    """Time [s] and frame of a message."""

    stamp: float = 0.0
    frame_id: str = ""


@dataclass(frozen=True)
class ForceAndTorque:
    """A `geometry_msgs/Wrench`: a force [N] and a torque [Nm]."""

    force: Vector = field(default_factory=Vector)
    torque: Vector = field(default_factory=Vector)


@dataclass(frozen=True)
class StampedWrench:
    """A `geometry_msgs/WrenchStamped`, about the origin of the frame in its header."""

    header: Header = field(default_factory=Header)
    wrench: ForceAndTorque = field(default_factory=ForceAndTorque)

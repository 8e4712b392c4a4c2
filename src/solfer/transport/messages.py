"""Messages of named numbers, and the table of message names.

A middleware's codec makes a message from its own wire format. Names are always part of it: everything from outside is
mapped by name, never by position.
"""

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from solfer.errors import UnknownName

JOINT_FIELDS = ("position", "velocity", "effort", "stiffness", "damping")
"""Fields of a JointMessage: [rad, m], [rad/s, m/s], [Nm, N], [Nm/rad], [Nms/rad]."""


GAINS = ("stiffness", "damping")
"""Those of them that are gains: they have no direction, and a lower level has values of its own for them."""

LARGEST_GAIN = 1e5
"""Bound of stiffness [Nm/rad] and damping [Nms/rad], far beyond the drives of every robot."""


@dataclass
class JointMessage:
    """Numbers of named DoFs; a field that is not carried is None, else its shape is (len(names),).

    Attributes:
        names: Names of the DoFs, in the order of the sender.
        interfaces: Names of what is carried beside these fields: further interfaces of a State.
        values: Their numbers, shape (len(interfaces), len(names)); None without any.
        stamp: Time at which the numbers were true, in the sender's clock [s].
        sender: Name of the node that sent it; empty where the middleware does not know.
    """

    names: tuple[str, ...]
    position: np.ndarray | None = None
    velocity: np.ndarray | None = None
    effort: np.ndarray | None = None
    stiffness: np.ndarray | None = None
    damping: np.ndarray | None = None
    interfaces: tuple[str, ...] = ()
    values: np.ndarray | None = None
    stamp: float = 0.0
    sender: str = ""

    @classmethod
    def empty(cls, names: tuple[str, ...], fields: tuple[str, ...]) -> "JointMessage":
        """Make a message with zeros in `fields`, for a writer that fills the same arrays every cycle."""
        arrays: dict[str, Any] = {name: np.zeros(len(names)) for name in fields if name in JOINT_FIELDS}
        others = tuple(name for name in fields if name not in JOINT_FIELDS)
        return cls(names, **arrays, interfaces=others, values=np.zeros((len(others), len(names))) if others else None)

    def numbers(self, interface: str) -> np.ndarray | None:
        """Return the numbers of a field or of another interface, shape (len(names),); None: it is not carried."""
        if interface in JOINT_FIELDS:
            return getattr(self, interface)
        if self.values is None or interface not in self.interfaces:
            return None
        return self.values[self.interfaces.index(interface)]


@dataclass
class BodyMessage:
    """Pose and twist of a link's origin, in the axes of `frame`.

    Attributes:
        frame: Frame of reference, such as 'world'.
        child: The link.
        position: Position of the link's origin, shape (3,) [m].
        orientation: Hamilton quaternion (x, y, z, w) that rotates from `child` to `frame`, shape (4,).
        linear: Velocity of the link's origin, shape (3,) [m/s].
        angular: Angular velocity of the link, shape (3,) [rad/s].
    """

    frame: str
    child: str
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    orientation: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    linear: np.ndarray = field(default_factory=lambda: np.zeros(3))
    angular: np.ndarray = field(default_factory=lambda: np.zeros(3))
    stamp: float = 0.0
    sender: str = ""


@dataclass
class VectorMessage:
    """A point, a vector, an orientation, a pose or a twist, in the axes of `frame`.

    Attributes:
        frame: Frame of reference.
        values: Linear before angular; an orientation is a Hamilton quaternion (x, y, z, w). Shape
            (VECTOR_MESSAGES[type],).
    """

    frame: str
    values: np.ndarray
    stamp: float = 0.0
    sender: str = ""


@dataclass
class PointsMessage:
    """Several Robot Points of one kind, in the axes of `frame`.

    Attributes:
        frame: Frame of reference.
        names: Names of the Points; empty where they have none.
        values: As in a VectorMessage, shape (n, k).
    """

    frame: str
    names: tuple[str, ...]
    values: np.ndarray
    stamp: float = 0.0
    sender: str = ""


@dataclass
class ImuMessage:
    """Measurements of an inertial measurement unit; vectors are in its own axes.

    Attributes:
        frame: The sensor's frame.
        orientation: Hamilton quaternion (x, y, z, w) that rotates from `frame` to the world, shape (4,).
        angular: Angular velocity against the world, shape (3,) [rad/s].
        acceleration: Specific force of the frame's origin, shape (3,) [m/s^2]; +9.81 upwards at rest.
        deviations: Standard deviations of one sample of orientation [rad], angular velocity and specific force, for
            each axis alike; zero where unknown.
    """

    frame: str
    orientation: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    angular: np.ndarray = field(default_factory=lambda: np.zeros(3))
    acceleration: np.ndarray = field(default_factory=lambda: np.zeros(3))
    deviations: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stamp: float = 0.0
    sender: str = ""


@dataclass
class WrenchMessage:
    """Force on a link and torque about the link's origin, in the axes of `frame`.

    Attributes:
        frame: Frame of the axes: 'world', or the link itself.
        force: Shape (3,) [N].
        torque: Shape (3,) [Nm].
    """

    frame: str
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    torque: np.ndarray = field(default_factory=lambda: np.zeros(3))
    stamp: float = 0.0
    sender: str = ""


@dataclass
class RefusalMessage:
    """Commands that a lower level refused; the tuples have one element for each sender.

    Attributes:
        owners: The senders.
        claims: Whether the sender's claim on its joints does not hold; false: the command itself was wrong.
        reasons: Why the sender's newest command was refused, in one line.
    """

    owners: tuple[str, ...]
    claims: tuple[bool, ...]
    reasons: tuple[str, ...]
    stamp: float = 0.0
    sender: str = ""


Message = JointMessage | BodyMessage | VectorMessage | PointsMessage | ImuMessage | WrenchMessage | RefusalMessage

JOINT_MESSAGES = {
    "sensor_msgs/JointState": ("position", "velocity", "effort"),
    "solfer/JointCommand": JOINT_FIELDS,
}
"""Joint-space messages by their canonical name, with the fields that each can carry."""

ANY_INTERFACE = "solfer/JointCommand"
"""The one of them that carries further interfaces of a State, too."""

BODY_MESSAGES = ("nav_msgs/Odometry",)
"""Messages of a rigid body by their canonical name."""

VECTOR_MESSAGES = {
    "geometry_msgs/PointStamped": 3,
    "geometry_msgs/Vector3Stamped": 3,
    "geometry_msgs/QuaternionStamped": 4,
    "geometry_msgs/PoseStamped": 7,
    "geometry_msgs/TwistStamped": 6,
}
"""Messages of geometry by their canonical name, with the length of their `values`."""

POINTS = "solfer/RobotPoints"
"""Message of several Robot Points."""

IMU_MESSAGES = ("sensor_msgs/Imu",)
"""Messages of an inertial measurement unit by their canonical name."""

WRENCH_MESSAGES = ("geometry_msgs/WrenchStamped",)
"""Messages of a force and a torque by their canonical name."""

REFUSALS = "solfer/Refusals"
"""Message of a lower level that lists refused commands. No pipe of a configuration carries it."""

ALIASES = {
    "custom_messages/CustomCmnd": "solfer/JointCommand",
    "gazebo_msgs/ContactsState": "geometry_msgs/WrenchStamped",
    "gazebo_msgs/LinkStates": "nav_msgs/Odometry",
}
"""Message names of the original program, and their replacements."""


def canonical(message: str, where: str = "") -> str:
    """Return the canonical name `package/Type` of a message; accepts `package::Type` and the names of ALIASES.

    Raises:
        UnknownName: No pipe can carry that message; `where` is the place of the name.
    """
    name = re.sub(r"::", "/", message)
    name = ALIASES.get(name, name)
    known = (*JOINT_MESSAGES, *BODY_MESSAGES, *VECTOR_MESSAGES, POINTS, *IMU_MESSAGES, *WRENCH_MESSAGES)
    if name not in known:
        raise UnknownName("message", message, (*known, *ALIASES), where=where)
    return name

"""Messages of named numbers, and the table of message names.

A middleware's codec makes a message from its own wire format. Names are always part of it: everything from outside is
mapped by name, never by position.
"""

import re
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np

from solfer.errors import MiddlewareError, UnknownName
from solfer.transport.lower_level import claimant

JOINT_FIELDS = ("position", "velocity", "effort", "stiffness", "damping")
"""Fields of a JointMessage: [rad, m], [rad/s, m/s], [Nm, N], [Nm/rad], [Nms/rad]."""


_ROWS = frozenset((*JOINT_FIELDS, "values"))

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
        component: Name of the component in that node whose message it is; empty: it is the node's.
        block: All that is carried in one array, of which the arrays above are rows, shape (len(rows), len(names));
            None: they lie apart, as they do once another array has taken the place of one.
        rows: What the rows of `block` are.
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
    component: str = ""
    rows: tuple[str, ...] = field(default=(), init=False, repr=False, compare=False)
    block: np.ndarray | None = field(default=None, init=False, repr=False, compare=False)

    @property
    def claimant(self) -> str:
        """Name of the sender that commands with it; see `solfer.transport.lower_level.claimant`."""
        return claimant(self.sender, self.component)

    @classmethod
    def empty(cls, names: tuple[str, ...], fields: tuple[str, ...], component: str = "") -> "JointMessage":
        """Make a message with zeros in `fields`, for a writer that fills the same arrays every cycle."""
        others = tuple(name for name in fields if name not in JOINT_FIELDS)
        rows = (*(name for name in JOINT_FIELDS if name in fields), *others)
        message = cls(names, interfaces=others, component=component)
        message.lay(rows, np.zeros((len(rows), len(names))))
        return message

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute; an array that takes the place of a row ends the block, which would be sent instead."""
        numbers = self.__dict__
        if "block" in numbers and name in _ROWS and value is not numbers.get(name):
            numbers["block"] = None
        numbers[name] = value

    def __deepcopy__(self, _: dict[int, Any]) -> "JointMessage":
        """Return a copy whose fields are rows of its own block."""
        return cast("JointMessage", copied(self))

    def lay(self, rows: tuple[str, ...], block: np.ndarray) -> None:
        """Let the rows of an array be what is carried; its `interfaces` are the last of `rows`."""
        fields = len(rows) - len(self.interfaces)
        for index in range(fields):
            setattr(self, rows[index], block[index])
        self.values = block[fields:] if self.interfaces else None
        self.rows = rows
        self.block = block

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
        pose_covariance: Of position [m] and rotations about the axes of `frame` [rad], shape (6, 6); zero: not known.
        twist_covariance: Of linear and angular velocity in the axes of `child`, as nav_msgs/Odometry has it, shape
            (6, 6) [m/s, rad/s]; zero: not known.
    """

    frame: str
    child: str
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    orientation: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    linear: np.ndarray = field(default_factory=lambda: np.zeros(3))
    angular: np.ndarray = field(default_factory=lambda: np.zeros(3))
    stamp: float = 0.0
    sender: str = ""
    pose_covariance: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    twist_covariance: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))


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
    """Measurements of an inertial measurement unit; vectors are in its own axes. All NaN: it does not measure that.

    Attributes:
        frame: The sensor's frame.
        orientation: Hamilton quaternion (x, y, z, w) that rotates from `frame` to the world, shape (4,).
        angular: Angular velocity against the world, shape (3,) [rad/s].
        acceleration: Specific force of its origin, shape (3,) [m/s^2]; +9.81 upwards at rest.
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
        owners: Who commanded, see `claimant`.
        claims: Whether the sender's claim on its joints does not hold; false: the command itself was wrong.
        reasons: Why the sender's newest command was refused, in one line.
    """

    owners: tuple[str, ...]
    claims: tuple[bool, ...]
    reasons: tuple[str, ...]
    stamp: float = 0.0
    sender: str = ""


@dataclass
class FieldsMessage:
    """A message of a topic that a component declares, by the names of the fields of its interface.

    Attributes:
        fields: Numbers, texts, tuples of them, and mappings of nested fields; not changed once it is made.
    """

    fields: dict[str, Any]
    stamp: float = 0.0
    sender: str = ""


Message = (
    JointMessage
    | BodyMessage
    | VectorMessage
    | PointsMessage
    | ImuMessage
    | WrenchMessage
    | RefusalMessage
    | FieldsMessage
)

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

ROBOT_POINTS = "solfer/RobotPoints"
"""Message of several Robot Points."""

IMU_MESSAGES = ("sensor_msgs/Imu",)
"""Messages of an inertial measurement unit by their canonical name."""

WRENCH_MESSAGES: tuple[str, ...] = ("geometry_msgs/WrenchStamped",)
"""Messages of a force and a torque by their canonical name."""

REFUSALS = "solfer/Refusals"
"""Message of a lower level that lists refused commands. No pipe of a configuration carries it."""

TYPES: dict[str, type[Message]] = {
    **dict.fromkeys(JOINT_MESSAGES, JointMessage),
    **dict.fromkeys(BODY_MESSAGES, BodyMessage),
    **dict.fromkeys(VECTOR_MESSAGES, VectorMessage),
    ROBOT_POINTS: PointsMessage,
    **dict.fromkeys(IMU_MESSAGES, ImuMessage),
    **dict.fromkeys(WRENCH_MESSAGES, WrenchMessage),
    REFUSALS: RefusalMessage,
}
"""Class of the messages by their canonical name."""


def arrays(message: Any) -> tuple[np.ndarray, ...]:
    """Return the arrays that hold all numbers of a message."""
    block = getattr(message, "block", None)
    if block is not None:
        return (block,)
    return tuple(value for value in vars(message).values() if isinstance(value, np.ndarray))


def copied(message: Any) -> Any:
    """Return a message with numbers of its own."""
    copy = object.__new__(type(message))  # as copy.copy does, at a third of the cost
    content = copy.__dict__
    content.update(message.__dict__)
    block = content.get("block")
    if block is not None:
        copy.lay(message.rows, block.copy())
        return copy
    for name, value in message.__dict__.items():
        if type(value) is np.ndarray:
            content[name] = value.copy()
    return copy


def type_of(message: str) -> type[Message]:
    """Return the class of the messages of a canonical name; what is none of TYPES travels as a FieldsMessage.

    Raises:
        MiddlewareError: It is no name of a message.
    """
    if message not in TYPES and not re.fullmatch(r"[A-Za-z]\w*/[A-Za-z]\w*", message):
        raise MiddlewareError(f"no message: {message}", expected=f"package/Type, such as {', '.join(TYPES)}")
    return TYPES.get(message, FieldsMessage)


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
    known = tuple(kind for kind in TYPES if kind != REFUSALS)
    if name not in known:
        raise UnknownName("message", message, (*known, *ALIASES), where=where)
    return name

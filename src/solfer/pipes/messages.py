"""Named numbers as they cross a border, and the table of message names.

A message is what a middleware's codec makes of its own wire format. Names are always part of it: everything from
outside is mapped by name, never by position.
"""

import re
from dataclasses import dataclass, field

import numpy as np

from solfer.errors import UnknownName

JOINT_FIELDS = ("position", "velocity", "effort", "stiffness", "damping")
"""Fields of a JointMessage: [rad, m], [rad/s, m/s], [Nm, N], [Nm/rad], [Nms/rad]."""


@dataclass
class JointMessage:
    """Numbers of named DoFs; a field that is not carried is None, else its shape is (len(names),).

    Attributes:
        names: Names of the DoFs, in the order of the sender.
        stamp: Time at which the numbers were true, in the sender's clock [s].
        sender: Who sent it; empty where the middleware does not tell.
    """

    names: tuple[str, ...]
    position: np.ndarray | None = None
    velocity: np.ndarray | None = None
    effort: np.ndarray | None = None
    stiffness: np.ndarray | None = None
    damping: np.ndarray | None = None
    stamp: float = 0.0
    sender: str = ""

    @classmethod
    def empty(cls, names: tuple[str, ...], fields: tuple[str, ...]) -> "JointMessage":
        """A message with zeros in `fields`, for a writer that fills the same arrays every cycle."""
        return cls(names, **{name: np.zeros(len(names)) for name in fields})


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


Message = JointMessage | BodyMessage

JOINT_MESSAGES = {
    "sensor_msgs/JointState": ("position", "velocity", "effort"),
    "solfer/JointCommand": JOINT_FIELDS,
}
"""Joint-space messages by their canonical name, with the fields that each can carry."""

BODY_MESSAGES = ("nav_msgs/Odometry",)
"""Messages of a rigid body by their canonical name."""

ALIASES = {
    "custom_messages/CustomCmnd": "solfer/JointCommand",
}
"""Names of the original program, and what stands for them."""


def canonical(message: str, where: str = "") -> str:
    """The canonical name `package/Type` of a message; `package::Type` and the names of ALIASES are understood.

    Raises:
        UnknownName: No pipe can carry that message; `where` is the place of the name.
    """
    name = re.sub(r"::", "/", message)
    name = ALIASES.get(name, name)
    known = (*JOINT_MESSAGES, *BODY_MESSAGES)
    if name not in known:
        raise UnknownName("message", message, (*known, *ALIASES), where=where)
    return name

"""A stand-in of a robot that goes to positions: its law is that of the documentation, of which it shares nothing."""

import math
from collections.abc import Callable

import numpy as np

from solfer.interfaces.declaration import Service
from solfer.interfaces.task_references import GetReference, ReferenceReply
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport import BodyMessage, Inbox
from solfer.transport.messages import FieldsMessage

PERIOD = 0.005  # [s]
AHEAD = 0.5
"""Time by whose way positions are ahead [s]."""


class GuidedBase:
    """A base on a bus that goes to positions with a share of the speed error / AHEAD.

    Args:
        bus: Where it is.
        heading: At the beginning [rad].
        count: Number of its vertices.

    Attributes:
        pace: Returns that share, which it publishes.
        pose: x, y, z, heading [m, rad].
        vertices: Shape (count, 3) [m].
        refusal: Why it does not say where it is; empty: it does.
        received: Whether it has received positions.
    """

    def __init__(self, bus: Bus, heading: float = 0.0, count: int = 4):
        self._node, self._inbox = MemoryMiddleware(bus, "robot"), Inbox()
        self._base = self._node.reader("locomotion/base", "geometry_msgs/PoseStamped")
        self._vertices = self._node.reader("locomotion/vertices", "solfer/RobotPoints")
        self._odometry = self._node.writer("odometry/odom", "nav_msgs/Odometry")
        self._pace = self._node.writer("locomotion/pace", "std_msgs/Float64")
        self.pace: Callable[[], float] = lambda: 1.0
        self.pose, self.vertices = np.array((0.5, -0.3, 0.9, heading)), np.full((count, 3), 0.4)
        self.refusal, self.received, self.is_silent = "", False, False
        service = Service("get_reference", "solfer/GetReference", GetReference, ReferenceReply, self._reference)
        self._node.serve("locomotion", (service,), self._inbox.submit)
        bus.every(PERIOD, self.cycle)

    def cycle(self) -> None:
        """Go on by one period."""
        self._inbox.apply()
        share = self.pace() * PERIOD / AHEAD
        self._pace.write(FieldsMessage({"data": self.pace()}))
        if self._base.read():
            x, y, z, _, _, sin, cos = self._base.message.values
            left = np.array((x, y, z, 2.0 * math.atan2(sin, cos))) - self.pose
            left[3] = math.remainder(left[3], math.tau)
            self.pose += share * left
            self.received = True
        if self._vertices.read():
            self.vertices += share * (self._vertices.message.values - self.vertices)
        if not self.is_silent:
            half = self.pose[3] / 2.0
            turn = np.array((0.0, 0.0, math.sin(half), math.cos(half)))
            self._odometry.write(BodyMessage("odom", "base", self.pose[:3].copy(), turn))

    def _reference(self, request: GetReference) -> ReferenceReply:
        if self.refusal:
            return ReferenceReply(False, self.refusal)
        half = self.pose[3] / 2.0
        base = (*self.pose[:3].tolist(), 0.0, 0.0, math.sin(half), math.cos(half))
        return ReferenceReply(values={"base": base, "vertices": tuple(self.vertices.ravel().tolist())}[request.task])

"""A stand-in of a robot that drives: it integrates received velocities, and publishes its odometry."""

import math
from collections.abc import Callable

import numpy as np

from solfer.interfaces.declaration import Service
from solfer.interfaces.support import LiftContacts, LiftReply
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport import BodyMessage, Inbox
from solfer.transport.messages import FieldsMessage

PERIOD = 0.005  # [s]
PATIENCE = 0.55
"""Time after the last `cmd_vel` when it stops [s]."""


class DrivenBase:
    """A base on a bus, with wheels whose vertices move.

    Args:
        bus: Where it is.
        target: Namespace of its topics.
        heading: At the beginning [rad].
        lifts: Whether it offers the service that lifts contacts.
        delay: Cycles until a contact is lifted.

    Attributes:
        pace: Returns the ratio of its velocities with which it goes on, which it publishes; None: whole, and silent.
    """

    def __init__(self, bus: Bus, target: str = "wheeled_motion", heading: float = 0.0, lifts: bool = True, delay=10):
        self._node, self._inbox = MemoryMiddleware(bus, "robot"), Inbox()
        self._twist = self._node.reader(f"{target}/cmd_vel", "geometry_msgs/Twist")
        self._state = self._node.reader(f"{target}/wheels_state", "solfer/WheelsState")
        self._support = self._node.reader(f"{target}/wheels_support", "solfer/WheelsSupport")
        self._odometry = self._node.writer("odometry/odom", "nav_msgs/Odometry")
        self._pace = self._node.writer(f"{target}/pace", "std_msgs/Float64")
        self.pace: Callable[[], float | None] = lambda: None
        self.pose, self.z, self.vertices = np.array((0.5, -0.3, heading)), 0.0, np.zeros((4, 3))
        self.is_silent, self.velocity, self.camber = False, np.zeros(3), ()
        self.lifted: list[tuple[float, tuple[str, ...], bool]] = []
        self.moved = 0.0
        self._delay, self._bus, self.refusal = delay, bus, ""
        if lifts:
            service = Service("lift", "solfer/LiftContacts", LiftContacts, LiftReply, self._lift)
            self._node.serve(target, (service,), self._inbox.submit)
        bus.every(PERIOD, self.cycle)

    def cycle(self) -> None:
        """Integrate by one period."""
        if self._delay_over():
            self._inbox.apply()
        self.velocity[:] = 0.0
        if self._twist.read() and self._twist.age() <= PATIENCE:
            linear, angular = self._twist.message.fields["linear"], self._twist.message.fields["angular"]
            cos, sin = math.cos(self.pose[2]), math.sin(self.pose[2])
            self.velocity += (
                cos * linear["x"] - sin * linear["y"], sin * linear["x"] + cos * linear["y"], angular["z"],
            )  # fmt: skip
        pace = self.pace()
        ratio = 1.0 if pace is None else pace if math.isfinite(pace) else 0.0
        if pace is not None:
            self._pace.write(FieldsMessage({"data": pace}))
        if self._state.read():
            fields = self._state.message.fields
            self.velocity += ratio * np.array((fields["x"], fields["y"], fields["rz"]))
            self.z, self.camber = self.z + ratio * fields["z"] * PERIOD, fields["cs"]
        if self._support.read():
            self.vertices += ratio * np.reshape(self._support.message.fields["velocity"], (4, 3)) * PERIOD
        self.pose += self.velocity * PERIOD
        self.moved += float(np.abs(self.velocity).sum()) * PERIOD
        if not self.is_silent:
            half = self.pose[2] / 2.0
            orientation = np.array((0.0, 0.0, math.sin(half), math.cos(half)))
            self._odometry.write(BodyMessage("odom", "base", np.array((*self.pose[:2], 0.9)), orientation))

    def _delay_over(self) -> bool:
        self._count = getattr(self, "_count", 0) + 1
        return self._count % self._delay == 0

    def _lift(self, request: LiftContacts) -> LiftReply:
        if self.refusal:
            return LiftReply(False, self.refusal)
        self.lifted.append((self._bus.time, tuple(request.contacts), request.lifted))
        return LiftReply()

"""The ground as odometry feels it, for components that stand on it."""

import logging
import math
from collections.abc import Sequence

import numpy as np

from solfer.errors import ComponentError
from solfer.interfaces.declaration import TopicIn
from solfer.interfaces.geometry import Vector, bare_frame
from solfer.interfaces.ground import GROUND, GROUND_FRAME, GroundEstimate
from solfer.numerics.planar_move import PlanarMove

log = logging.getLogger(__name__)

SILENCE = 0.5
"""Time without a message after which that is named [s]."""

STEEPEST = math.radians(60.0)
"""Slope beyond which no robot stands [rad]: a steeper normal is a mistake."""


class FeltGround:
    """The normals of the ground at contacts, by the newest message that can be true.

    A contact that a message does not name is on the plane under the robot as a whole.

    Args:
        component: Name of the component that uses it, for messages.
        topic: Topic of `solfer/Ground`, such as `odometry/ground`.
        names: Names of the contacts.
        normals: Their normals until the first message, shape (c, 3).

    Attributes:
        normals: Unit normals in the world, shape (c, 3); live.
    """

    def __init__(self, component: str, topic: str, names: Sequence[str], normals: np.ndarray):
        self._component = component
        self._topic = topic
        self._names = names
        self._configured = normals.copy()
        self.normals = normals.copy()
        self._silent = 0.0

    def start(self) -> None:
        """Begin with the normals of the configuration: the robot may have been carried elsewhere."""
        self.normals[:] = self._configured
        self._silent = 0.0

    def topics(self) -> tuple[TopicIn]:
        """Declare the topic."""
        return (TopicIn(f"/{self._topic}", GROUND, GroundEstimate, self.receive, ordered=True),)

    def update(self, step: float) -> None:
        """Note that a time [s] passes; silence is named once."""
        before = self._silent
        self._silent += step
        if before <= SILENCE < self._silent:
            log.warning("%s: %s is silent for %g s; the ground counts as it was", self._component, self._topic, SILENCE)

    def receive(self, message: GroundEstimate) -> None:
        """Take the normals of a message.

        Raises:
            ComponentError: It is in another frame than `odom`, its lists are not of one length, or a normal is none of
                a ground that a robot stands on. Nothing changes.
        """
        if bare_frame(message.header.frame_id) != GROUND_FRAME:
            raise ComponentError(
                f"a ground in the frame '{message.header.frame_id}'", expected=f"the frame '{GROUND_FRAME}'"
            )
        if len(message.names) != len(message.normals):
            raise ComponentError(
                f"a ground with {len(message.names)} names and {len(message.normals)} normals",
                expected="one normal for each contact",
            )
        plane = _checked("the plane", message.normal)
        felt = {
            name: _checked(f"'{name}'", normal) for name, normal in zip(message.names, message.normals, strict=True)
        }
        self._silent = 0.0
        for index, name in enumerate(self._names):
            self.normals[index] = felt.get(name, plane)

    def move_world(self, move: PlanarMove) -> None:
        """See `Component.move_world`."""
        for normal in self.normals:
            move.rotate(normal)


def _checked(place: str, normal: Vector) -> tuple[float, float, float]:
    """Return a normal of length one; a ComponentError if it is none."""
    numbers = (normal.x, normal.y, normal.z)
    length = math.hypot(*numbers)
    if not abs(length - 1.0) < 1e-3:
        raise ComponentError(
            f"the normal ({normal.x:g}, {normal.y:g}, {normal.z:g}) of {place}", expected="three numbers of length 1"
        )
    if normal.z < math.cos(STEEPEST):
        slope = math.degrees(math.acos(max(normal.z / length, -1.0)))
        raise ComponentError(
            f"a normal of {place} that is {slope:.0f} deg from the vertical",
            expected=f"at most {math.degrees(STEEPEST):.0f} deg",
        )
    return normal.x / length, normal.y / length, normal.z / length

"""Operational-space feedback: a measured link tells the six DoFs of the floating base (Listing 7 of the paper)."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.model import State
from solfer.numerics import BaseChart
from solfer.numerics.rotations import cross
from solfer.pipes.alignment import Alignment
from solfer.pipes.body_reading import BodyReading
from solfer.pipes.channel import Channel
from solfer.pipes.endpoints import Reader
from solfer.pipes.feedback import StateFeedback
from solfer.pipes.joint import MakeFilter
from solfer.pipes.messages import Message
from solfer.pipes.mount import Mount

BASE = np.arange(6)
"""DoFs of a floating base: x y z rx ry rz."""

FULL_TURN = 2.0 * math.pi
"""[rad]."""

STEEP = math.radians(75.0)
"""|ry| from which on the chart of the base is said to be near its singularity [rad]."""


class BodyFeedback(StateFeedback):
    """Reads the floating base of a State from what is told about a link, or about a sensor on it.

    With the pose (p_s, R_s) and the twist (v_s, w_s) of the sensor in the world, and its pose (r, R) and twist (v, w)
    against the base in the axes of the base, the base has

        R_b = R_s R^T                    w_b = w_s - R_b w
        p_b = p_s - R_b r                v_b = v_s - w_b x R_b r - R_b v.

    Angles go on where they were: they do not jump by 2 pi.

    Args:
        name: Name of the pipe in the configuration.
        reader: Where the messages come from.
        state: State whose first six DoFs are written.
        chart: Chart of the base.
        mount: Where the sensor sits.
        reading: Reads the messages.
        fields: `position` for the pose, `velocity` for its rates.
        located: Whether position and linear velocity are used; else orientation and angular velocity only.
        required: Whether the plugin has to wait for this pipe before it starts.
        low_pass: Makes the filter of one field; None: there is none.
        calibrated: Whether heading and position of the first message, of a start, are taken for those of the State.
    """

    def __init__(
        self,
        name: str,
        reader: Reader,
        state: State,
        chart: BaseChart,
        mount: Mount,
        reading: BodyReading,
        fields: Sequence[str],
        located: bool = True,
        required: bool = True,
        low_pass: MakeFilter | None = None,
        calibrated: bool = False,
    ):
        used = slice(0 if located else 3, 6)
        dofs = BASE[used]
        channels = [Channel(field, dofs, low_pass(len(dofs)) if low_pass else None) for field in fields]
        super().__init__(name, reader, state, channels, required, low_pass is not None)
        self._chart, self._mount, self._reading = chart, mount, reading
        self._base, self._rates, self._before = np.zeros(6), np.zeros(6), np.zeros(3)
        self._angles = self._base[3:]
        self._alignment = Alignment() if calibrated else None
        self._tells_pose = "position" in fields
        self._tells_rates = "velocity" in fields
        self._measured = {"position": self._base[used], "velocity": self._rates[used]}

    def _decode(self, message: Message) -> None:
        self._reading.read(message)
        self._mount.update()
        if self._tells_pose:
            rotation = self._pose()
        else:
            self._base[:] = self._state.position[:6]
            rotation = self._chart.to_rotation(self._base)
        if self._tells_rates:
            self._twist(rotation)
        for channel in self._channels:
            np.copyto(channel.values, self._measured[channel.field])

    def _pose(self) -> np.ndarray:
        """Write the base; its rotation to the world, shape (3, 3)."""
        reading, mount = self._reading, self._mount
        rotation, position = reading.rotation, reading.position
        if not mount.trivial:
            rotation = rotation @ mount.rotation.T
            position = position - rotation @ mount.position
        if self._alignment is not None:
            position, rotation = self._align(position, rotation)
        np.copyto(self._before, self._angles)
        self._chart.from_rotation(position, rotation, self._base)
        self._warn(self._angles[1])
        if self.accepted:
            np.subtract(self._before, self._angles, out=self._before)
            self._before *= 1.0 / FULL_TURN
            np.rint(self._before, out=self._before)
            self._before *= FULL_TURN
            self._angles += self._before
        return rotation

    def _align(self, position: np.ndarray, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The base's pose in the Robot's world, from the one in the sender's."""
        alignment, state = self._alignment, self._state.position
        if not self.heard:
            known = self._chart.position + self._chart.rotation @ state[:3]
            alignment.fit((position, rotation), (known, self._chart.to_rotation(state)))
        return alignment.turn @ position + alignment.shift, alignment.turn @ rotation

    def _twist(self, rotation: np.ndarray) -> None:
        """Write the rates of the base."""
        reading, mount = self._reading, self._mount
        linear, angular = reading.linear, reading.angular
        if reading.in_body_axes:
            turn = rotation @ mount.rotation
            linear, angular = turn @ linear, turn @ angular
        elif self._alignment is not None:
            linear, angular = self._alignment.turn @ linear, self._alignment.turn @ angular
        if not mount.trivial:
            angular = angular - rotation @ mount.angular
            linear = linear - cross(angular, rotation @ mount.position) - rotation @ mount.linear
        self._chart.rates_from_twist(self._base, linear, angular, self._rates)

    def _warn(self, tilt: float) -> None:
        if abs(tilt) > STEEP:
            self._throttle.warning("steep", "feedback '%s': the base is tilted by ry = %.0f deg; at 90 deg its angles "
                                   "are not unique, and its rates are not to be trusted", self.name, math.degrees(tilt))

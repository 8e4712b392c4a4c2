"""Operational-space feedback: a measured link tells the six DoFs of the floating base (Listing 7 of the paper)."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.model import State
from solfer.numerics import BaseChart
from solfer.numerics.rotations import rotation_from_quaternion
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

STEEP = math.radians(75.0)
"""|ry| from which on the chart of the base is said to be near its singularity [rad]."""


class BodyFeedback(StateFeedback):
    """Reads the floating base of a State from what is told about a link, or about a sensor on it.

    See `solfer.numerics.carried` for the equations. Angles go on where they were: they do not jump by 2 pi.

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
        channels = [Channel(state, field, dofs, low_pass(len(dofs)) if low_pass else None) for field in fields]
        super().__init__(name, reader, state, channels, required, low_pass is not None)
        # the compiler behind it takes a while to load
        from solfer.numerics.carried import GO_ON, ORIENTED, OWN_AXES, POSE, TWIST, Carried

        self._chart, self._mount, self._reading = chart, mount, reading
        self._carried, self._own_axes, self._go_on = Carried(chart, reading.told, mount.numbers), OWN_AXES, GO_ON
        self._alignment = Alignment(self._carried.world) if calibrated else None
        self._tells_pose, self._known = "position" in fields, state.position[:6]
        self._options = ((POSE if self._tells_pose else 0) | (TWIST if "velocity" in fields else 0)
                         | (ORIENTED if "orientation" in reading.carries else 0))
        measured = {"position": self._carried.base[used], "velocity": self._carried.rates[used]}
        self._measured = [(channel.values, measured[channel.field]) for channel in channels]

    def _decode(self, message: Message) -> None:
        reading, carried, options = self._reading, self._carried, self._options
        reading.read(message)
        self._mount.update()
        if reading.own_axes:
            options |= self._own_axes
        if self.accepted:
            options |= self._go_on
        if not self._tells_pose:
            carried.base[...] = self._known
        elif self._alignment is not None and not self.heard:
            self._align()
        carried.update(options)
        if self._tells_pose:
            self._warn(carried.base[4])
        for values, measured in self._measured:
            values[...] = measured

    def _align(self) -> None:
        """Fit the sender's world to the Robot's, in which the base is where the State says."""
        told, mount, state = self._reading.told, self._mount, self._state.position
        rotation = rotation_from_quaternion(told[:4]) @ mount.rotation.T
        known = self._chart.position + self._chart.rotation @ state[:3]
        self._alignment.fit((told[4:7] - rotation @ mount.position, rotation), (known, self._chart.to_rotation(state)))

    def _warn(self, tilt: float) -> None:
        if abs(tilt) > STEEP:
            self._throttle.warning("steep", "feedback '%s': the base is tilted by ry = %.0f deg; at 90 deg its angles "
                                   "are not unique, and its rates are not to be trusted", self.name, math.degrees(tilt))

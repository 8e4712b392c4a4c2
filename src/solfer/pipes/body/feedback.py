"""Operational-space feedback: the six DoFs of the floating base from a measured link (Listing 7 of the paper)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solfer.errors import PipeError
from solfer.model import State
from solfer.numerics import BaseChart
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.pipes.body.alignment import Alignment
from solfer.pipes.body.reading import BodyReading
from solfer.pipes.body.sensor_mount import SensorMount
from solfer.pipes.body.turn_check import TurnCheck
from solfer.pipes.state_feedback_pipe import Reception, StateFeedbackPipe
from solfer.transport.endpoints import Reader
from solfer.transport.messages import Message

STEEP = math.radians(75.0)
"""|ry| above which a warning is logged: the chart of the base is near its singularity [rad]."""


@dataclass(frozen=True)
class BodySensor:
    """What measures the link of a feedback pipe.

    Attributes:
        mount: Pose of the sensor on the robot.
        reading: Reads its messages.
        located: Whether position and linear velocity are used; else orientation and angular velocity only.
        calibrated: Whether heading and position of the first message of a start are aligned with those of the State.
    """

    mount: SensorMount
    reading: BodyReading
    located: bool = True
    calibrated: bool = False


class BodyFeedbackPipe(StateFeedbackPipe):
    """Reads the floating base of a State from messages of a link, or of a sensor on it.

    See `solfer.numerics.twist_transport` for the equations. Angles are continuous: they do not jump by 2 pi.

    Args:
        name: Name of the pipe in the configuration.
        reader: Receives the messages.
        state: State of which the first six DoFs are written.
        chart: Chart of the base.
        sensor: What measures the link.
        fields: `position` for the pose, `velocity` for its rates.
        reception: How it receives.
    """

    def __init__(
        self,
        name: str,
        reader: Reader,
        state: State,
        chart: BaseChart,
        sensor: BodySensor,
        *,
        fields: Sequence[str],
        reception: Reception,
    ):
        used = slice(0 if sensor.located else 3, 6)
        dofs = np.arange(6)[used]  # of x y z rx ry rz
        super().__init__(name, reader, state, fields=fields, dofs=dofs, reception=reception)
        # imported here: its compiler takes a while to load
        from solfer.numerics.twist_transport import (
            CONTINUOUS,
            FROM_POSE,
            FROM_TWIST,
            OWN_AXES,
            WITH_ORIENTATION,
            Carried,
        )

        mount = sensor.mount
        reading = sensor.reading
        self._chart = chart
        self._mount = mount
        self._reading = reading
        self._carried = Carried(chart, reading.values, mount.numbers)
        self._own_axes = OWN_AXES
        self._go_on = CONTINUOUS
        self._alignment = Alignment(self._carried.world) if sensor.calibrated else None
        self._measures_pose = "position" in fields
        self._known = state.position[:6]
        self._options = (FROM_POSE if self._measures_pose else 0) | (FROM_TWIST if "velocity" in fields else 0)
        self._oriented = WITH_ORIENTATION if "orientation" in reading.carries else 0
        is_turned = reception.measured and self._measures_pose and "orientation" in reading.carries
        self._turn_check = TurnCheck() if is_turned else None
        carried = {"position": self._carried.base[used], "velocity": self._carried.rates[used]}
        if self.history is not None:
            self.history.place = mount.position
        self._measured = [(state_field.values, carried[state_field.field]) for state_field in self.state_fields]

    def restart(self) -> None:
        """See `FeedbackPipe.restart`."""
        super().restart()
        if self._turn_check is not None:
            self._turn_check.forget()
        if self.history is not None:
            self.history.contradiction = ""

    def check_fit(self, message: Message, quantity: str = "") -> None:
        """See `FeedbackPipe.check_fit`."""
        self._reading.check_body(message)

    def _match(self, message: Message) -> None:
        self._reading.read(message)
        if not self._reading.lacks:
            return
        needs = (("position", "orientation", "orientation"), ("velocity", "angular", "angular velocity"))
        for field, quantity, text in needs:
            if quantity in self._reading.lacks and any(each.field == field for each in self.state_fields):
                raise PipeError(
                    f"the sensor measures no {text}", expected=f"a sensor that does, or interface: {{{field}: false}}"
                )

    def _decode(self, message: Message) -> None:
        self._match(message)
        reading = self._reading
        carried = self._carried
        options = self._options
        if "orientation" not in reading.lacks:
            options |= self._oriented
        if self._turn_check is not None:
            history = self.history
            if history is not None and history.contradiction:
                if not (self._turn_check.is_distrusted and history.others_rest()):
                    self._turn_check.distrust(history.contradiction)
            oddity = self._turn_check.check(
                reading.values, reading.own_axes, self.reader.arrival, self._stamp, force=reading.force
            )
            if history is not None:
                history.contradiction = ""
                np.dot(self._mount.rotation, reading.force, out=history.force)
            if oddity:
                self.warnings.warn("force", oddity)
        self._mount.update()
        if reading.own_axes:
            options |= self._own_axes
        if self.accepted:
            options |= self._go_on
        if not self._measures_pose:
            carried.base[...] = self._known
        elif self._alignment is not None and not self.received:
            self._align()
        carried.update(options)
        if self._measures_pose and abs(carried.base[4]) > STEEP:
            self._warn(carried.base[4])
        for values, measured in self._measured:
            values[...] = measured
        self._write_fields(self.reader.arrival)

    def _align(self) -> None:
        """Align the sender's world so that the base is at the pose of the State."""
        values = self._reading.values
        mount = self._mount
        state = self._state.position
        rotation = rotation_from_quaternion(values[:4]) @ mount.rotation.T
        known = self._chart.position + self._chart.rotation @ state[:3]
        self._alignment.fit(
            (values[4:7] - rotation @ mount.position, rotation), (known, self._chart.to_rotation(state))
        )

    def _warn(self, tilt: float) -> None:
        self.warnings.throttle.warning(
            "steep",
            "feedback '%s': the base is tilted by ry = %.0f deg; at 90 deg its angles "
            "are not unique, and its rates are not to be trusted",
            self.name,
            math.degrees(tilt),
        )

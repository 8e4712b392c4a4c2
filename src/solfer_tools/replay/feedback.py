"""Feedback pipes that receive what was recorded."""

import numpy as np

from solfer.errors import RecordingError
from solfer.interfaces.port import Port
from solfer.pipes import FeedbackPipe, StateFeedbackPipe
from solfer.pipes.contact.pipes import ContactFeedbackPipe
from solfer.recording.kinds import JOINT_PARTS
from solfer.robot import Robot
from solfer.transport.endpoints import NEW, NONE, OLD, MessageStatus
from solfer.transport.messages import Message
from solfer_tools.replay.rows import RecordedRows


class RecordedFeedbackPipe(FeedbackPipe):
    """Stands in for a pipe: writes the numbers that it had received in each cycle, and filters them as it does.

    A pipe that the recording does not have takes what was measured, or desired, of its DoFs.

    Args:
        pipe: The pipe.
        rows: The recorded cycles.
        robot: The Robot of the pipe.
        port: Input of the component that the pipe feeds; None: it writes a State.

    Attributes:
        pipe: See above.
        row: Index of the present cycle; to be set before each.
        unrepeated: What it received that cannot be repeated, in words; empty: all of it is repeated.

    Raises:
        RecordingError: Nothing that was recorded fits the pipe.
        UnknownName: What was recorded lacks one of its DoFs.
    """

    def __init__(self, pipe: FeedbackPipe, rows: RecordedRows, robot: Robot, port: Port | None):
        super().__init__(pipe.name, pipe.reader, pipe.required)
        self.pipe = pipe
        self.row = 0
        self._port = port
        self.unrepeated = ""
        if isinstance(pipe, StateFeedbackPipe) and pipe.history is not None:
            self.unrepeated = f"each message of feedback '{pipe.name}', of which the newest one of a cycle was recorded"
        self._arrays: list[np.ndarray] = []
        self._values: list[np.ndarray] = []
        if isinstance(pipe, StateFeedbackPipe):
            for field in pipe.state_fields:
                names = [robot.dofs[dof] for dof in field.dofs]
                self._add(rows, field.values, f"{pipe.name}/{field.field}", columns=names, field=field.field)
        elif isinstance(pipe, ContactFeedbackPipe):
            for name, wrench in pipe.wrenches.items():
                self._add(rows, wrench, f"{pipe.name}/{name}", columns=())
        elif port is not None:
            self._add(rows, port.value, f"{pipe.name}/value", columns=())
        else:
            raise _not_recorded(pipe.name, rows)
        self._arrivals = _arrivals(rows, pipe.name)

    @property
    def lacks(self) -> str:
        """See `FeedbackPipe.lacks`."""
        return self.pipe.lacks

    def check_start(self) -> None:
        """See `FeedbackPipe.check_start`."""
        self.pipe.check_start()

    def run(self) -> MessageStatus:
        """Take the numbers of the present cycle."""
        new = self._is_new()
        if isinstance(self.pipe, StateFeedbackPipe) and self.pipe.history is not None:
            self.pipe.history.clear()
        if new:
            for array, values in zip(self._arrays, self._values, strict=True):
                array[...] = values[self.row].reshape(array.shape)
            self.pipe.repeat(self._arrivals[self.row])
            self.accepted = self.accepted + 1
            self.arrival = self.pipe.arrival
            self.received = True
        if self._port is not None:
            self._port.fresh = new
        if isinstance(self.pipe, StateFeedbackPipe):
            self.pipe.filter()
        return NEW if new else OLD if self.accepted else NONE

    def restart(self) -> None:
        """See `FeedbackPipe.restart`."""
        super().restart()
        self.pipe.restart()

    def _is_new(self) -> bool:
        """Return whether a message has arrived since the cycle before: its time or its numbers are others."""
        row = self.row
        if not np.isfinite(self._arrivals[row]) or any(np.isnan(values[row]).any() for values in self._values):
            return False
        if row == 0 or not np.isfinite(self._arrivals[row - 1]):
            return True
        # [s]: ages are recorded to the last bit, times to the nanosecond
        later = self._arrivals[row] - self._arrivals[row - 1] > 1e-7
        return bool(later) or any((values[row] != values[row - 1]).any() for values in self._values)

    def _add(
        self, rows: RecordedRows, array: np.ndarray, name: str, columns: list[str] | tuple, field: str = ""
    ) -> None:
        """Add numbers that are written in each cycle."""
        channel = rows.channel(f"feedback/{name}")
        if channel is None and field in JOINT_PARTS:
            measures = isinstance(self.pipe, StateFeedbackPipe) and self.pipe.measures
            state = "measured" if measures else "wanted"
            self.unrepeated = (
                f"feedback '{self.pipe.name}', which was not recorded: it gets what was {state} of its joints"
            )
            channel = rows.channel(f"{state}/{field}")
        if channel is None:
            raise _not_recorded(self.pipe.name, rows)
        values = rows.values(channel, columns or channel.columns)
        if values.shape[1] != array.size:
            raise RecordingError(
                f"'{channel.name}' has {values.shape[1]} numbers", where=rows.where, expected=f"{array.size} of them"
            )
        self._arrays.append(array)
        self._values.append(values)

    def _decode(self, message: Message) -> None:
        """Do nothing: no message is received."""


def _arrivals(rows: RecordedRows, pipe: str) -> np.ndarray:
    """Return when the newest message of a pipe had arrived, in each cycle [s]; minus infinity: never."""
    channel = rows.channel(f"feedback/{pipe}/age")
    if channel is None:
        return rows.times
    ages = rows.values(channel, ("age",))[:, 0]
    return np.where(np.isfinite(ages), rows.times - np.where(np.isfinite(ages), ages, 0.0), -np.inf)


def _not_recorded(pipe: str, rows: RecordedRows) -> RecordingError:
    return RecordingError(
        f"what feedback '{pipe}' of '{rows.plugin}' received was not recorded",
        where=rows.where,
        expected="pipes of joints, bodies, contacts or inputs of the component",
    )

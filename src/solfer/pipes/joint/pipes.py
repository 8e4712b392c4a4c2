"""Joint-space pipes: numbers of named DoFs in and out of a State (Listing 6 of the paper)."""

import logging
from collections.abc import Callable, Collection, Sequence

import numpy as np

from solfer.errors import NotFinite, PipeError
from solfer.model import BidirectionalMap, State
from solfer.numerics.filters import LowPass
from solfer.pipes.command_pipe import CommandPipe
from solfer.pipes.feedback_pipe import StateFeedbackPipe
from solfer.pipes.joint.calibration import Calibration, Correction
from solfer.pipes.joint.start_limits import StartLimits
from solfer.pipes.name_order import NameOrder, Order
from solfer.pipes.state_field import StateField, interface_of
from solfer.transport.endpoints import Reader, Writer
from solfer.transport.messages import JOINT_FIELDS, JointMessage

logger = logging.getLogger(__name__)

MakeFilter = Callable[[int], LowPass]
"""Makes a filter of a given size."""


def external_names(mapping: BidirectionalMap) -> tuple[str, ...]:
    """Return the names of the mapped DoFs, in the order of the other end."""
    return tuple(mapping.external[index] for index in mapping.external_indices)


class JointFeedbackPipe(StateFeedbackPipe):
    """Reads DoFs of a State from a topic.

    A message that does not fit (an unknown joint, a wrong size, NaN) is refused whole: the State keeps its values.
    DoFs that a message lacks keep their values.

    Args:
        name: Name of the pipe in the configuration.
        reader: Receives the messages.
        mapping: Map between the Robot and the sender, already restricted to the DoFs of the pipe.
        state: State that is written.
        fields: Fields of the message that are used.
        required: Whether the plugin has to wait for this pipe before it starts.
        calibration: That of the sending hardware, in the map's order; None: it has the model's names, signs and zeros.
        low_pass: Makes the filter of one field; None: there is none.
        known: Names beside those of the map that a message may contain; None: any.
        measured: Whether the State is measured; see `StateFeedbackPipe`.
        limits: Checks the values with which a plugin starts; None: all are accepted. The plugin waits for such a pipe.
    """

    def __init__(
        self,
        name: str,
        reader: Reader,
        mapping: BidirectionalMap,
        state: State,
        fields: Sequence[str],
        required: bool = True,
        calibration: Calibration | None = None,
        low_pass: MakeFilter | None = None,
        known: Collection[str] | None = None,
        measured: bool = False,
        limits: StartLimits | None = None,
    ):
        dofs = np.array(mapping.robot_indices)
        state_fields = [StateField(state, field, dofs, low_pass(len(dofs)) if low_pass else None) for field in fields]
        super().__init__(
            name, reader, state, state_fields, required or limits is not None, low_pass is not None, measured
        )
        self._limits = limits
        self._order: Order | None = None
        self._names = NameOrder(calibration.names if calibration else external_names(mapping), known)
        self._interfaces: tuple[str, ...] = ()
        self._rows = [-1] * len(fields)  # of the interfaces that are no field of a message: their places in it
        self._corrections: list[tuple[Correction, np.ndarray]] = []
        if calibration is not None:
            self._corrections = [
                (calibration.to_robot(state_field.field), state_field.values) for state_field in state_fields
            ]

    @property
    def lacks(self) -> str:
        """See `FeedbackPipe.lacks`."""
        absent = self._names.absent()
        whole = super().lacks
        return f"{', '.join(absent)} of {whole}" if 0 < len(absent) < len(self._names.not_received) else whole

    def check_start(self) -> None:
        """See `FeedbackPipe.check_start`."""
        if self._limits is not None and self.received:
            self._limits.check(self._state)

    def restart(self) -> None:
        """See `FeedbackPipe.restart`."""
        super().restart()
        self._names.forget()

    def _complete(self) -> bool:
        return not self._names.not_received.any()

    def _match(self, message: JointMessage) -> None:
        self._order = order = self._names.match(message.names)
        self.part = order.target

    def _gather(self, message: JointMessage) -> None:
        names, order = message.names, self._order
        source, target, count = order.source, order.target, len(names)
        if message.interfaces != self._interfaces:
            self._find_rows(message.interfaces)
        for state_field, row in zip(self.state_fields, self._rows, strict=True):
            values = state_field.values
            if row >= 0 and message.values is not None:
                numbers = message.values[row]
            else:
                numbers = getattr(message, state_field.field, None)
            if numbers is None or len(numbers) != count:
                got = "nothing" if numbers is None else f"{len(numbers)} numbers"
                raise PipeError(f"{got} in '{state_field.field}'", expected=f"{count} numbers, one for each name")
            part = values if target is None else np.empty(len(source))
            wrong = state_field.gather(numbers, source, part)
            if wrong >= 0:
                name = names[source[wrong]]
                raise NotFinite(f"a '{state_field.field}' of joint '{name}' that is not a finite number")
            if target is not None:
                values.fill(0.0)
                values[target] = part
        for correct, values in self._corrections:
            correct(values, values)
        if not self.received:
            self._note(order)

    def _find_rows(self, interfaces: tuple[str, ...]) -> None:
        """Find the fields of the pipe among the further interfaces of a message."""
        self._interfaces = interfaces
        self._rows = [
            interfaces.index(each.field) if each.field in interfaces and each.field not in JOINT_FIELDS else -1
            for each in self.state_fields
        ]

    def _note(self, order: Order) -> None:
        """Record which DoFs are received; resets the filters if some are received for the first time."""
        if not self._names.note(order):
            return
        not_received = self._names.not_received
        self._ever = np.flatnonzero(~not_received) if not_received.any() else None
        for state_field in self.state_fields:
            state_field.reset()
        if order.target is not None:
            logger.info(
                "feedback '%s': %s has %d of %d joints; the others keep their values",
                self.name,
                self.reader.topic,
                len(order.target),
                len(not_received),
            )


class JointCommandPipe(CommandPipe):
    """Writes DoFs of a State to a topic.

    Args:
        name: Name of the pipe in the configuration.
        writer: Publishes the messages.
        mapping: Map between the Robot and the receiver, already restricted to the DoFs of the pipe.
        state: State that is read.
        fields: Fields of the message that are filled.
        calibration: That of the receiving hardware, in the map's order; None: it has the model's names, signs and
            zeros.
        low_pass: Makes the filter of one field; None: there is none.

    Attributes:
        message: The next command, in the model's names, signs and zeros; a gate may change its values in place.
        sent: The command as the receiver gets it, in its names, signs and zeros; without a calibration `message`.
        dofs: The Robot's DoFs in the order of the message, shape (n,).
    """

    def __init__(
        self,
        name: str,
        writer: Writer,
        mapping: BidirectionalMap,
        state: State,
        fields: Sequence[str],
        calibration: Calibration | None = None,
        low_pass: MakeFilter | None = None,
    ):
        message = sent = JointMessage.empty(external_names(mapping), tuple(fields))
        self.fields = [(field, message.numbers(field)) for field in fields]
        self._corrections: list[tuple[Correction, np.ndarray, np.ndarray]] = []
        if calibration is not None:
            sent = JointMessage.empty(calibration.names, tuple(fields))
            self._corrections = [
                (calibration.to_hardware(field), values, sent.numbers(field)) for field, values in self.fields
            ]
        super().__init__(name, writer, sent)
        self.message, self.dofs = message, np.array(mapping.robot_indices)
        self._sources = [(state[interface_of(field)], values) for field, values in self.fields]
        self._filters = [(low_pass(len(values)), values) for _, values in self.fields] if low_pass else []

    def collect(self) -> None:
        """Copy the values of the State into `message`."""
        for source, values in self._sources:
            source.take(self.dofs, out=values, mode="clip")
        for low_pass, values in self._filters:
            low_pass.step(values)

    def send(self, stamp: float) -> None:
        """Send `message`, stamped with `stamp` [s]."""
        for correct, values, out in self._corrections:
            correct(values, out)
        super().send(stamp)

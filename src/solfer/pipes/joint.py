"""Joint-space pipes: numbers of named DoFs in and out of a State (Listing 6 of the paper)."""

import logging
from collections.abc import Callable, Collection, Sequence

import numpy as np

from solfer.errors import NotFinite, PipeError
from solfer.model import BidirectionalMap, State
from solfer.numerics.filters import LowPass
from solfer.pipes.calibration import Calibration, Correction
from solfer.pipes.channel import INTERFACES, Channel
from solfer.pipes.controller import Controller
from solfer.pipes.endpoints import Reader, Writer
from solfer.pipes.feedback import StateFeedback
from solfer.pipes.messages import JointMessage
from solfer.pipes.names import NameOrder, Order

logger = logging.getLogger(__name__)

MakeFilter = Callable[[int], LowPass]
"""Makes the filter of as many numbers as it is told."""


def external_names(mapping: BidirectionalMap) -> tuple[str, ...]:
    """Names of the mapped DoFs, in the order of the other end."""
    return tuple(mapping.external[index] for index in mapping.external_indices)


class JointFeedback(StateFeedback):
    """Reads DoFs of a State from a topic.

    A message that does not fit (an unknown joint, a wrong size, NaN) is refused whole: the State keeps what it had.
    DoFs that a message lacks keep their values.

    Args:
        name: Name of the pipe in the configuration.
        reader: Where the messages come from.
        mapping: Map between the Robot and the sender, already restricted to the DoFs of the pipe.
        state: State that is written.
        fields: Fields of the message that are used, of `INTERFACES`.
        required: Whether the plugin has to wait for this pipe before it starts.
        calibration: Of the hardware that sends, in the map's order; None: it has the model's names, signs and zeros.
        low_pass: Makes the filter of one field; None: there is none.
        known: Names that a message may bring besides those of the map; None: any.
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
    ):
        dofs = np.array(mapping.robot_indices)
        channels = [Channel(state, field, dofs, low_pass(len(dofs)) if low_pass else None) for field in fields]
        super().__init__(name, reader, state, channels, required, low_pass is not None)
        self._names = NameOrder(calibration.names if calibration else external_names(mapping), known)
        self._corrections: list[tuple[Correction, np.ndarray]] = []
        if calibration is not None:
            self._corrections = [(calibration.to_robot(channel.field), channel.values) for channel in channels]

    @property
    def lacks(self) -> str:
        """See `Feedback.lacks`."""
        absent = self._names.absent()
        whole = super().lacks
        return f"{', '.join(absent)} of {whole}" if 0 < len(absent) < len(self._names.unheard) else whole

    def restart(self) -> None:
        """See `Feedback.restart`."""
        super().restart()
        self._names.forget()

    def _complete(self) -> bool:
        return not self._names.unheard.any()

    def _decode(self, message: JointMessage) -> None:
        names = message.names
        order = self._names.match(names)
        source, target, count = order.source, order.target, len(names)
        for channel in self.channels:
            numbers, values = getattr(message, channel.field), channel.values
            if numbers is None or len(numbers) != count:
                got = "nothing" if numbers is None else f"{len(numbers)} numbers"
                raise PipeError(f"{got} in '{channel.field}'", expected=f"{count} numbers, one a name")
            part = values if target is None else np.empty(len(source))
            wrong = channel.gather(numbers, source, part)
            if wrong >= 0:
                name = names[source[wrong]]
                raise NotFinite(f"a '{channel.field}' of joint '{name}' that is not a finite number")
            if target is not None:
                values.fill(0.0)
                values[target] = part
        for correct, values in self._corrections:
            correct(values, values)
        self.part = target
        if not self.heard:
            self._note(order)

    def _note(self, order: Order) -> None:
        """Take down which DoFs are heard; filters begin anew where some are heard for the first time."""
        if not self._names.note(order):
            return
        unheard = self._names.unheard
        self._ever = np.flatnonzero(~unheard) if unheard.any() else None
        for channel in self.channels:
            channel.reset()
        if order.target is not None:
            logger.info("feedback '%s': %s tells %d of %d joints; the others keep their values", self.name,
                        self.reader.topic, len(order.target), len(unheard))


class JointController(Controller):
    """Writes DoFs of a State to a topic.

    Args:
        name: Name of the pipe in the configuration.
        writer: Where the messages go.
        mapping: Map between the Robot and the receiver, already restricted to the DoFs of the pipe.
        state: State that is read.
        fields: Fields of the message that are filled, of `INTERFACES`.
        calibration: Of the hardware that receives, in the map's order; None: it has the model's names, signs and zeros.
        low_pass: Makes the filter of one field; None: there is none.

    Attributes:
        message: What is sent next, in the model's names, signs and zeros; a gate may change its numbers in place.
        sent: What the receiver gets, in its names, signs and zeros; without a calibration it is `message`.
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
        self.fields = [(field, getattr(message, field)) for field in fields]
        self._corrections: list[tuple[Correction, np.ndarray, np.ndarray]] = []
        if calibration is not None:
            sent = JointMessage.empty(calibration.names, tuple(fields))
            self._corrections = [
                (calibration.to_hardware(field), values, getattr(sent, field)) for field, values in self.fields
            ]
        super().__init__(name, writer, sent)
        self.message, self.dofs = message, np.array(mapping.robot_indices)
        self._sources = [(state[INTERFACES[field]], values) for field, values in self.fields]
        self._filters = [(low_pass(len(values)), values) for _, values in self.fields] if low_pass else []

    def collect(self) -> None:
        """Take the numbers of the State into `message`."""
        for source, values in self._sources:
            source.take(self.dofs, out=values, mode="clip")
        for low_pass, values in self._filters:
            low_pass.step(values)

    def send(self, stamp: float) -> None:
        """Send `message`, stamped with `stamp` [s]."""
        for correct, values, out in self._corrections:
            correct(values, out)
        super().send(stamp)

"""Joint-space pipes: numbers of named DoFs in and out of a State (Listing 6 of the paper)."""

from collections.abc import Callable, Sequence

import numpy as np

from solfer.errors import NotFinite, PipeError, nearest
from solfer.model import BidirectionalMap, State
from solfer.numerics.filters import LowPass
from solfer.pipes.calibration import Calibration, Correction
from solfer.pipes.controller import Controller
from solfer.pipes.endpoints import Reader, Writer
from solfer.pipes.feedback import INTERFACES, Channel, StateFeedback
from solfer.pipes.messages import JointMessage

MakeFilter = Callable[[int], LowPass]
"""Makes the filter of as many numbers as it is told."""


class NameOrder:
    """Where wanted names stand in a message; computed again only when the sender changes its order.

    Args:
        wanted: Names that a message has to bring; it may bring more.
    """

    def __init__(self, wanted: Sequence[str]):
        self._wanted = tuple(wanted)
        self._names: tuple[str, ...] | None = None
        self.indices = np.zeros(len(self._wanted), dtype=np.intp)

    def match(self, names: tuple[str, ...]) -> np.ndarray:
        """Indices of the wanted names in `names`, shape (len(wanted),).

        Raises:
            PipeError: A wanted name is missing, or a name stands there twice.
        """
        if names == self._names:
            return self.indices
        if len(set(names)) < len(names):
            twice = sorted({name for name in names if names.count(name) > 1})
            raise PipeError(f"joint names that stand twice in a message: {', '.join(twice)}")
        place = {name: index for index, name in enumerate(names)}
        missing = [name for name in self._wanted if name not in place]
        if missing:
            raise PipeError(
                f"a message without {len(missing)} of the pipe's {len(self._wanted)} joints, such as '{missing[0]}'",
                names=nearest(missing[0], names),
            )
        self.indices[:] = [place[name] for name in self._wanted]
        self._names = names
        return self.indices


def external_names(mapping: BidirectionalMap) -> tuple[str, ...]:
    """Names of the mapped DoFs, in the order of the other end."""
    return tuple(mapping.external[index] for index in mapping.external_indices)


class JointFeedback(StateFeedback):
    """Reads DoFs of a State from a topic.

    A message that does not fit (a joint missing, a wrong size, NaN) is refused whole: the State keeps what it had.

    Args:
        name: Name of the pipe in the configuration.
        reader: Where the messages come from.
        mapping: Map between the Robot and the sender, already restricted to the DoFs of the pipe.
        state: State that is written.
        fields: Fields of the message that are used, of `INTERFACES`.
        required: Whether the plugin has to wait for this pipe before it starts.
        calibration: Of the hardware that sends, in the map's order; None: it has the model's names, signs and zeros.
        low_pass: Makes the filter of one field; None: there is none.
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
    ):
        dofs = np.array(mapping.robot_indices)
        channels = [Channel(field, dofs, low_pass(len(dofs)) if low_pass else None) for field in fields]
        super().__init__(name, reader, state, channels, required)
        self._order = NameOrder(calibration.names if calibration else external_names(mapping))
        self._corrections: list[tuple[Correction, np.ndarray]] = []
        if calibration is not None:
            self._corrections = [(calibration.to_robot(channel.field), channel.values) for channel in channels]

    def _decode(self, message: JointMessage) -> None:
        order = self._order.match(message.names)
        for channel in self._channels:
            self._take(channel.field, channel.values, message, order)
        for correct, values in self._corrections:
            correct(values, values)

    def _take(self, field: str, values: np.ndarray, message: JointMessage, order: np.ndarray) -> None:
        numbers = getattr(message, field)
        if numbers is None or len(numbers) != len(message.names):
            got = "nothing" if numbers is None else f"{len(numbers)} numbers"
            raise PipeError(f"{got} in '{field}'", expected=f"{len(message.names)} numbers, one a name")
        np.take(numbers, order, out=values, mode="clip")
        if not np.isfinite(values).all():
            name = message.names[order[int(np.argmin(np.isfinite(values)))]]
            raise NotFinite(f"a '{field}' of joint '{name}' that is not a finite number")


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
            np.take(source, self.dofs, out=values, mode="clip")
        for low_pass, values in self._filters:
            low_pass.step(values)

    def send(self, stamp: float) -> None:
        """Send `message`, stamped with `stamp` [s]."""
        for correct, values, out in self._corrections:
            correct(values, out)
        super().send(stamp)

"""Joint-space pipes: numbers of named DoFs in and out of a State (Listing 6 of the paper)."""

import logging
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from solfer.errors import NotFinite, PipeError
from solfer.model import BidirectionalMap, State
from solfer.pipes.command_pipe import CommandPipe
from solfer.pipes.joint.calibration import Calibration, Correction, same
from solfer.pipes.joint.leaps import JointLeaps
from solfer.pipes.joint.start_limits import StartLimits
from solfer.pipes.joint.turns import JointTurns
from solfer.pipes.name_order import ORDER_MEMORY, NameOrder, Order
from solfer.pipes.state_feedback_pipe import MakeFilter, Reception, StateFeedbackPipe
from solfer.pipes.state_field import interface_of
from solfer.transport.endpoints import Reader, Writer
from solfer.transport.messages import JOINT_FIELDS, JointMessage, arrays

logger = logging.getLogger(__name__)


def external_names(mapping: BidirectionalMap) -> tuple[str, ...]:
    """Return the names of the mapped DoFs, in the order of the other end."""
    return tuple(mapping.external[index] for index in mapping.external_indices)


@dataclass(frozen=True)
class JointSender:
    """What a feedback pipe knows of the joints of its sender, and what it checks of their values.

    Attributes:
        calibration: That of the sending hardware, in the map's order; None: it has the model's names, signs and zeros.
        known: Names beside those of the map that a message may contain; None: any.
        limits: Checks the values with which a plugin starts; None: all are accepted. The plugin waits for such a pipe.
        leaps: Finds measurements that cannot be true; None: all are accepted.
        turns: Adds turns to positions of continuous joints; None: the pipe has none of them.
    """

    calibration: Calibration | None = None
    known: Collection[str] | None = None
    limits: StartLimits | None = None
    leaps: JointLeaps | None = None
    turns: JointTurns | None = None


class JointFeedbackPipe(StateFeedbackPipe):
    """Reads DoFs of a State from a topic.

    A message that does not fit (a misspelt joint, a wrong size, NaN) is refused whole: the State keeps its values.
    DoFs that a message lacks keep their values, and joints that the robot lacks are ignored.

    Args:
        name: Name of the pipe in the configuration.
        reader: Receives the messages.
        mapping: Map between the Robot and the sender, already restricted to the DoFs of the pipe.
        state: State that is written.
        fields: Fields of the message that are used.
        reception: How it receives.
        sender: The joints of the sender.
    """

    def __init__(
        self,
        name: str,
        reader: Reader,
        mapping: BidirectionalMap,
        state: State,
        fields: Sequence[str],
        *,
        reception: Reception,
        sender: JointSender,
    ):
        calibration = sender.calibration
        if sender.limits is not None:
            reception = replace(reception, required=True)
        super().__init__(name, reader, state, fields=fields, dofs=np.array(mapping.robot_indices), reception=reception)
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import gather

        self._gather = gather
        self._limits = sender.limits
        self._leaps = sender.leaps if "position" in fields else None
        self._turns = sender.turns if "position" in fields else None
        self._of_position = fields.index("position") if "position" in fields else 0
        of_velocity = fields.index("velocity") if "velocity" in fields else len(fields)
        self._velocity = self.values[of_velocity] if of_velocity < len(fields) else np.zeros(0)
        self._names = NameOrder(
            calibration.names if calibration else external_names(mapping), sender.known, ignores=True
        )
        self._logged: set[tuple[int, ...]] = set()  # the DoFs of messages that lack some
        self._carried: tuple[str, ...] = ()
        self._rows = self._in_order = np.arange(len(fields))  # of the fields: in a message, and in the pipe
        self._corrections: list[tuple[Correction, np.ndarray]] = []
        if calibration is not None:
            self._corrections = [
                (calibration.to_robot(state_field.field), state_field.values) for state_field in self.state_fields
            ]

    @property
    def lacks(self) -> str:
        """See `FeedbackPipe.lacks`."""
        absent = self._names.absent()
        whole = super().lacks
        return f"{', '.join(absent)} of {whole}" if 0 < len(absent) < len(self._names.not_received) else whole

    @property
    def silent(self) -> str:
        """See `FeedbackPipe.silent`; with the joints that its newer messages lack."""
        stalest = None if self._watch is None else self._watch.stalest
        if stalest is None or not stalest.lost:
            return super().silent
        return f"{stalest.name} ({', '.join(self._names.names(stalest.dofs))})"

    def check_start(self) -> None:
        """See `FeedbackPipe.check_start`."""
        if self._limits is not None and self.received:
            self._limits.check(self._state)

    def check_fit(self, message: JointMessage, quantity: str = "") -> None:
        """See `FeedbackPipe.check_fit`."""
        self._names.require_all(message.names)
        for state_field in self.state_fields:
            if message.numbers(state_field.field) is None:
                carried = [name for name in JOINT_FIELDS if message.numbers(name) is not None]
                raise PipeError(
                    f"'{state_field.field}' is not sent, only {', '.join((*carried, *message.interfaces))}",
                    expected=f"interface: {{{state_field.field}: true}} where it is sent",
                )

    def restart(self) -> None:
        """See `FeedbackPipe.restart`."""
        super().restart()
        self._names.forget()
        if self._leaps is not None:
            self._leaps.forget()

    def _complete(self) -> bool:
        return not self._names.not_received.any()

    def _match(self, message: JointMessage) -> None:
        self.part = self._names.match(message.names).target

    def _decode(self, message: JointMessage) -> None:
        names = message.names
        numbers = message.block
        matched = self._names
        order = matched.order if names is matched.matched else matched.match(names)
        if numbers is None:
            rows = self._in_order
            numbers = self._stacked(message)
        else:
            if message.rows is not self._carried:
                self._find_rows(message.rows, len(names))
            rows = self._rows
        self.part = order.target
        wrong = self._gather(numbers, rows, order.source, order.places, self.values)
        if wrong >= 0:
            row, place = divmod(wrong, len(order.source))
            field = self.state_fields[row].field
            name = names[order.source[place]]
            raise NotFinite(f"a '{field}' of joint '{name}' that is not a finite number")
        for correct, values in self._corrections:
            correct(values, values)
        part = order.places
        position = self.values[self._of_position]
        if self._turns is not None:
            self._turns.unwrap(position, part)
        if self._leaps is not None:
            arrival = self.reader.arrival
            wrong = self._leaps.find(position, self._velocity, part, arrival, self._stamp)
            if wrong >= 0:
                self._leaps.refuse(wrong, position, self._velocity, arrival)
        if self._turns is not None:
            self._turns.keep(position, part)
        if not self.received:
            self._note(order)

    def _find_rows(self, carried: tuple[str, ...], count: int) -> None:
        """Find the fields of the pipe in messages with `count` names that have their numbers in one array."""
        for each in self.state_fields:
            if each.field not in carried:
                raise _unfit(each.field, None, count)
        self._rows = np.array([carried.index(each.field) for each in self.state_fields], dtype=np.int64)
        self._carried = carried

    def _stacked(self, message: JointMessage) -> np.ndarray:
        """Return the fields of the pipe in a message whose numbers lie apart, one below the other."""
        count = len(message.names)
        stacked = np.empty((len(self.state_fields), count))
        for row, each in enumerate(self.state_fields):
            numbers = message.numbers(each.field)
            if numbers is None or len(numbers) != count:
                raise _unfit(each.field, numbers, count)
            stacked[row] = numbers
        return stacked

    def _note(self, order: Order) -> None:
        """Record which DoFs are received; resets the filters if some are received for the first time."""
        if not self._names.note(order):
            return
        not_received = self._names.not_received
        self._ever = np.flatnonzero(~not_received) if not_received.any() else None
        for state_field in self.state_fields:
            state_field.reset()
        part = None if order.target is None else tuple(order.target)
        if part is not None and part not in self._logged and len(self._logged) < ORDER_MEMORY:
            self._logged.add(part)
            logger.info(
                "feedback '%s': %s has %d of %d joints; the others keep their values",
                self.name,
                self.reader.topic,
                len(order.target),
                len(not_received),
            )


def _unfit(field: str, numbers: np.ndarray | None, count: int) -> PipeError:
    got = "nothing" if numbers is None else f"{len(numbers)} numbers"
    without = f", or a pipe with `{field}: false`" if numbers is None else ""
    return PipeError(f"{got} in '{field}'", expected=f"{count} numbers, one for each name{without}")


@dataclass(frozen=True)
class JointReceiver:
    """What a command pipe knows of the joints of its receiver.

    Attributes:
        calibration: That of the receiving hardware, in the map's order; None: it has the model's names, signs and
            zeros.
        turns: `revolutions` and `added_revolutions` of the Robot; None: the receiver counts turns as the State does.
        controller: Name of the controller of the lower level; empty: that of the pipe's name.
        standing: Stiffness and damping that its joints have without a command, by field, shape (n,) each; those that
            the pipe carries, of a lower level that publishes them.
        component: Name of the component whose commands it receives; empty: the node's.
    """

    calibration: Calibration | None = None
    turns: tuple[np.ndarray, np.ndarray] | None = None
    controller: str = ""
    standing: Mapping[str, np.ndarray] = field(default_factory=dict)
    component: str = ""


class JointCommandPipe(CommandPipe):
    """Writes DoFs of a State to a topic.

    Args:
        name: Name of the pipe in the configuration.
        writer: Publishes the messages.
        mapping: Map between the Robot and the receiver, already restricted to the DoFs of the pipe.
        state: State that is read.
        fields: Fields of the message that are filled.
        receiver: The joints of the receiver.
        low_pass: Makes the filter of one field; None: there is none.

    Attributes:
        controller: Name of the controller of the lower level that gets the commands, if one does.
        message: The next command, in the model's names, signs and zeros; a gate may change its values in place.
        sent: The command as the receiver gets it, in its names, signs, zeros and turns; `message` if all are the same.
        fields: Fields that are filled, each with its values in `message`, shape (n,).
        block: These values one below the other, shape (len(fields), n).
        dofs: The Robot's DoFs in the order of the message, shape (n,).
        standing: That of the receiver.
    """

    def __init__(
        self,
        name: str,
        writer: Writer,
        mapping: BidirectionalMap,
        state: State,
        fields: Sequence[str],
        *,
        receiver: JointReceiver,
        low_pass: MakeFilter | None = None,
    ):
        component = receiver.component
        calibration = receiver.calibration
        turns = receiver.turns
        self.standing = receiver.standing
        self._calibration = calibration
        self.controller = receiver.controller or name
        message = sent = JointMessage.empty(external_names(mapping), tuple(fields), component)
        (self.block,) = arrays(message)
        self.fields = list(zip(message.rows, self.block, strict=True))
        self.dofs = np.array(mapping.robot_indices)
        self._added = turns[1] if turns is not None and turns[0][self.dofs].any() else None
        self._more = np.zeros(len(self.dofs))
        self._corrections: list[tuple[Correction, np.ndarray, np.ndarray]] = []
        if calibration is not None or (self._added is not None and "position" in fields):
            names = message.names if calibration is None else calibration.names
            sent = JointMessage.empty(names, tuple(fields), component)
            self._corrections = [
                (self._correction(field), values, sent.numbers(field)) for field, values in self.fields
            ]
        super().__init__(name, writer, sent)
        self.message = message
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import collect
        from solfer.numerics.pointers import address

        # arrays of a State stay where they are
        live = np.array([address(state[interface_of(field)]) for field in message.rows], dtype=np.int64)
        self._collect = partial(collect, live, self.dofs, self.block)
        self._filters = [(low_pass(len(values)), values) for _, values in self.fields] if low_pass else []
        if not self._filters:
            self.collect = self._collect  # type: ignore[method-assign] # without a call in between
        self._attributes = vars(sent)  # to assign one, a message looks for its arrays

    def to_receiver(self, field: str, values: np.ndarray) -> np.ndarray:
        """Return a field's `values`, shape (n,), in the signs, zeros and turns of the receiver."""
        out = np.array(values)
        self._correction(field)(values, out)
        return out

    def _correction(self, field: str) -> Correction:
        """Return what makes a field of the receiver of one of the Robot."""
        correct = same if self._calibration is None else self._calibration.to_hardware(field)
        if field != "position" or self._added is None:
            return correct
        added = self._added
        more = self._more
        dofs = self.dofs

        def position(values: np.ndarray, out: np.ndarray) -> None:
            np.take(added, dofs, out=more, mode="clip")
            np.subtract(values, more, out=out)
            correct(out, out)

        return position

    def collect(self) -> None:
        """Copy the values of the State into `message`."""
        self._collect()
        for low_pass, values in self._filters:
            low_pass.step(values)

    def send(self, stamp: float) -> None:
        """Send `message`, stamped with `stamp` [s]."""
        for correct, values, out in self._corrections:
            correct(values, out)
        self._attributes["stamp"] = stamp
        self.writer.write(self.sent)

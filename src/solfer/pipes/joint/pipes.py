"""Joint-space pipes: numbers of named DoFs in and out of a State (Listing 6 of the paper)."""

import logging
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NoReturn

import numpy as np

from solfer.errors import NotFinite, PipeError
from solfer.model import BidirectionalMap, State
from solfer.pipes.command_pipe import CommandPipe
from solfer.pipes.joint.calibration import Calibration
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
        from solfer.numerics.blocks import MemoryBlock
        from solfer.pipes.joint.kernel import RECEPTION, receive

        self._limits = sender.limits
        self._leaps = sender.leaps if "position" in fields else None
        self._turns = sender.turns if "position" in fields else None
        destination = self._destination
        corrected = calibration or Calibration.none(external_names(mapping))
        self._block = MemoryBlock(
            RECEPTION,
            rows=len(fields),
            count=len(destination.dofs),
            values=self.values,
            sign=corrected.signs(fields),
            offset=corrected.offsets(fields),
            position=self._row("position", 0),
            velocity=self._row("velocity", -1),
            turns=0 if self._turns is None else self._turns.address,
            leaps=0 if self._leaps is None else self._leaps.address,
            writes=not self._filtered,
            dofs=destination.dofs,
            state=destination.live,
        )
        self._receive = partial(receive, self._block.address)
        self._names = NameOrder(corrected.names, sender.known, ignores=True)
        self._logged: set[tuple[int, ...]] = set()  # the DoFs of messages that lack some
        self._carried: tuple[str, ...] = ()
        self._rows = self._in_order = np.arange(len(fields))  # of the fields: in a message, and in the pipe

    def _row(self, field: str, default: int) -> int:
        """Return the row of a field in `values`."""
        return next((row for row, each in enumerate(self.state_fields) if each.field == field), default)

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
        arrival = self.reader.arrival
        found = self._receive(numbers, rows, order.source, order.places, arrival, self._stamp)
        if found >= 0:
            self._refuse_numbers(found, names, order, arrival)
        if not self.received:
            self._note(order)
        if self._filtered:
            self._write_fields(arrival)
        elif found < -1:
            self.changed = arrival
            versions = self._state.versions
            for interface in self._destination.changed[-1 - found]:
                versions[interface] += 1

    def _refuse_numbers(self, found: int, names: tuple[str, ...], order: Order, arrival: float) -> NoReturn:
        """Refuse what the compiled step has found in a message that arrived at `arrival` [s]."""
        count = len(order.source)
        row, place = divmod(found, count)
        if row < len(self.state_fields):
            name = names[order.source[place]]
            raise NotFinite(f"a '{self.state_fields[row].field}' of joint '{name}' that is not a finite number")
        velocity = self.values[self._row("velocity", 0)]
        self._leaps.refuse(
            found - count * len(self.state_fields), self.values[self._row("position", 0)], velocity, arrival
        )

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
        step: What the compiled steps of a cycle work on. Of its arrays `lower` and `upper` are the bounds of `block`,
            beyond which is what is not finite, too, `kept` is what was sent last, of the same shape, and `steps` the
            time for which each row acts, shape (len(fields),) [s], see `solfer.numerics.kernels`.
        moved: The largest step of a joint that was sent last [rad, m].
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
        turns = receiver.turns
        self.standing = receiver.standing
        self.controller = receiver.controller or name
        message = sent = JointMessage.empty(external_names(mapping), tuple(fields), component)
        (self.block,) = arrays(message)
        self.fields = list(zip(message.rows, self.block, strict=True))
        self.dofs = np.array(mapping.robot_indices, dtype=np.int64)
        self._added = turns[1] if turns is not None and turns[0][self.dofs].any() else None
        self._calibration = receiver.calibration or Calibration.none(message.names)
        if receiver.calibration is not None or (self._added is not None and "position" in fields):
            sent = JointMessage.empty(self._calibration.names, tuple(fields), component)
        super().__init__(name, writer, sent)
        self.message = message
        self.moved = 0.0
        self._filters = [(low_pass(len(values)), values) for _, values in self.fields] if low_pass else []
        self._attributes = vars(sent)  # to assign one, a message looks for its arrays
        self._bind(state)

    def _bind(self, state: State) -> None:
        """Prepare the compiled steps of a cycle."""
        # imported here: its compiler takes a while to load
        from solfer.numerics.blocks import MemoryBlock
        from solfer.numerics.pointers import address
        from solfer.pipes.joint.kernel import COMMAND, fill, pack

        fields = self.message.rows
        is_turned = self._added is not None and "position" in fields
        added = self._added if is_turned else np.zeros(0)
        self.step = MemoryBlock(
            COMMAND,
            rows=len(fields),
            count=len(self.dofs),
            size=len(added),
            block=self.block,
            dofs=self.dofs,
            # arrays of a State stay where they are
            state=np.array([address(state[interface_of(field)]) for field in fields], dtype=np.int64),
            lower=np.full_like(self.block, -np.inf),
            upper=np.full_like(self.block, np.inf),
            kept=np.zeros_like(self.block),
            steps=np.full(len(fields), -1.0),
            sent=self.sent.block,
            corrects=self.sent is not self.message,
            sign=self._calibration.signs(fields),
            shift=0.0 - self._calibration.offsets(fields),  # zero without a sign: it changes no number
            turning=fields.index("position") if is_turned else -1,
            added=added,
        )
        self._fill = partial(fill, self.step.address)
        self._pack = partial(pack, self.step.address)
        if not self._filters:
            self.collect = self._fill  # type: ignore[method-assign] # without a call in between

    def to_receiver(self, field: str, values: np.ndarray) -> np.ndarray:
        """Return a field's `values`, shape (n,), in the signs, zeros and turns of the receiver."""
        if field == "position" and self._added is not None:
            values = values - self._added[self.dofs]
        return self._calibration.signs([field])[0] * values + self._calibration.offsets([field])[0]

    def collect(self) -> bool:
        """Copy the values of the State into `message`; return whether any is not finite, or beyond its bounds."""
        self._fill()
        for low_pass, values in self._filters:
            low_pass.step(values)
        arrays = self.step.arrays
        return not ((self.block >= arrays["lower"]) & (self.block <= arrays["upper"]) & np.isfinite(self.block)).all()

    def send(self, stamp: float) -> None:
        """Send `message`, stamped with `stamp` [s], and keep it."""
        self.moved = self._pack()
        self._attributes["stamp"] = stamp
        self.writer.write(self.sent)

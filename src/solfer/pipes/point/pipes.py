"""Pipes that carry Robot Points between plugins: from a port of one component to that of another."""

import logging
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from solfer.errors import NotFinite, PipeError
from solfer.interfaces.geometry import bare_frame
from solfer.interfaces.port import Port
from solfer.numerics.kernels import finite
from solfer.numerics.rotations import normalize
from solfer.pipes.command_pipe import CommandPipe
from solfer.pipes.feedback_pipe import FeedbackPipe
from solfer.pipes.name_order import NameOrder
from solfer.pipes.point.notation import PointNotation
from solfer.throttle import Throttle
from solfer.transport.endpoints import NEW, OLD, MessageStatus, Reader, Writer
from solfer.transport.inexact import InexactOrientations
from solfer.transport.messages import Message, PointsMessage, VectorMessage, WrenchMessage


@dataclass(frozen=True)
class PointFormat:
    """How messages have the Points of a pipe.

    Attributes:
        frame: Frame of the values.
        names: Names of several Points, in the order of the port; None: the sender's order.
        notation: Notation of the orientations; None: that of the port.
    """

    frame: str
    names: tuple[str, ...] | None = None
    notation: PointNotation | None = None


class PointFeedbackPipe(FeedbackPipe):
    """Writes received Points to an input of the component.

    Args:
        name: Name of the pipe in the configuration.
        reader: Receives the messages.
        port: The input.
        received: Required format of the messages.
        required: Whether the plugin has to wait for this pipe before it starts.
        known: Other names that a message may contain; None: any.

    Attributes:
        what: What the names denote, for errors.
    """

    what = "Point"

    def __init__(
        self,
        name: str,
        reader: Reader,
        port: Port,
        received: PointFormat,
        required: bool = True,
        *,
        known: Collection[str] | None = (),
    ):
        super().__init__(name, reader, required)
        self._port = port
        self._frame = received.frame
        self._notation = received.notation
        self._names = None if received.names is None else NameOrder(received.names, known, self.what)
        self._inexact = InexactOrientations()
        self._oriented = port.quantity in ("orientation", "pose")
        self._values = np.zeros_like(port.value)
        self._numbers = self._values.reshape(-1)

    @property
    def lacks(self) -> str:
        """See `FeedbackPipe.lacks`."""
        absent = [] if self._names is None else self._names.absent()
        whole = super().lacks
        return f"{', '.join(absent)} of {whole}" if 0 < len(absent) < len(self._values) else whole

    def run(self) -> MessageStatus:
        """See `FeedbackPipe.run`."""
        status = self.reader.read()
        if status is NEW and not self._accept():
            status = OLD
        self._port.fresh = status is NEW
        if status is NEW:
            self._port.value[...] = self._values
        return status

    def check_fit(self, message: Message, quantity: str = "") -> None:
        """See `FeedbackPipe.check_fit`."""
        if quantity and quantity != self._port.quantity:
            raise PipeError(f"it carries the quantity '{quantity}'", expected=f"quantity: {self._port.quantity}")
        self._check_frame(message)
        if isinstance(message, PointsMessage):
            if self._names is not None:
                self._names.require_all(message.names)
            elif len(message.values) != len(self._values):
                raise PipeError(f"it carries {len(message.values)} Points", expected=f"{len(self._values)} of them")

    def restart(self) -> None:
        """See `FeedbackPipe.restart`."""
        super().restart()
        if self._names is not None:
            self._names.forget()

    def _complete(self) -> bool:
        return self._names is None or not self._names.not_received.any()

    def _decode(self, message: Message) -> None:
        if message.frame != self._frame:
            self._check_frame(message)
        if isinstance(message, WrenchMessage):
            self._values[:3], self._values[3:] = message.force, message.torque
        elif self._names is not None:
            self._copy_named(message)
        elif self._notation is not None and self._port.count is None:
            self._notation.read(message.values, self._values)
        else:
            np.copyto(self._values, self._as_here(message.values, self._values.shape))
        if self._notation is not None and not self._notation.located:
            self._values[..., :3] = self._port.value[..., :3]
        if not finite(self._numbers):
            raise NotFinite(f"a {self._port.quantity} that is not finite")
        if self._oriented and normalize(self._values[..., -4:]):
            self._inexact.report(message.sender)

    def _check_frame(self, message: Message) -> None:
        if bare_frame(message.frame) != self._frame:
            raise PipeError(f"numbers in the axes of '{message.frame}'", expected=f"axes of '{self._frame}'")

    def _copy_named(self, message: Message) -> None:
        """Copy several Points; those that the message lacks keep their values."""
        names = self._names
        order = names.order if message.names is names.matched else names.match(message.names)
        values = self._as_here(message.values, (len(message.names), self._values.shape[1]))
        if order.target is None:
            values.take(order.source, axis=0, out=self._values, mode="clip")
        else:
            np.copyto(self._values, self._port.value)
            self._values[order.target] = values[order.source]
        if not self.received:
            names.note(order)

    def _as_here(self, values: np.ndarray, declared: tuple[int, ...]) -> np.ndarray:
        """Return received numbers of a declared shape in the notation of the port."""
        if values.shape != declared:
            raise PipeError(f"numbers of shape {values.shape}", expected=f"shape {declared}")
        return values if self._notation is None else self._notation.read(values, np.empty_like(values))


class PointCommandPipe(CommandPipe):
    """Publishes an output of the component; values that are NaN or infinite are not sent.

    Args:
        name: Name of the pipe in the configuration.
        writer: Publishes the messages.
        port: The output.
        published: Format of the messages.
    """

    def __init__(self, name: str, writer: Writer, port: Port, published: PointFormat):
        self._port = port
        self._throttle = Throttle(logging.getLogger(__name__))
        self._notation = published.notation
        frame = published.frame
        self._values = np.zeros_like(port.value)
        self._numbers = self._values.reshape(-1)
        self._finite = True
        if port.count is not None:
            super().__init__(name, writer, PointsMessage(frame, published.names or (), self._values))
        elif port.quantity == "wrench":
            super().__init__(name, writer, WrenchMessage(frame, self._values[:3], self._values[3:]))
        else:
            super().__init__(name, writer, VectorMessage(frame, self._values))

    @property
    def quantity(self) -> str:
        """See `CommandPipe.quantity`."""
        return self._port.quantity

    def collect(self) -> None:
        """See `CommandPipe.collect`."""
        if self._notation is None:
            self._values[...] = self._port.value
        else:
            self._notation.write(self._port.value, self._values)
        self._finite = finite(self._numbers)

    def send(self, stamp: float) -> None:
        """See `CommandPipe.send`."""
        if self._finite:
            self.sent.stamp = stamp
            self.writer.write(self.sent)
        else:
            self._throttle.warning(
                "finite", "controller '%s': a %s that is not finite is not sent", self.name, self._port.quantity
            )

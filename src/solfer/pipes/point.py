"""Pipes that carry Robot Points between plugins: from a port of one component to that of another."""

import logging
from collections.abc import Collection

import numpy as np

from solfer.components.port import Port
from solfer.errors import NotFinite, PipeError
from solfer.logs import Throttle
from solfer.numerics.finite import all_finite
from solfer.numerics.rotations import require_unit
from solfer.pipes.controller import Controller
from solfer.pipes.endpoints import Reader, Status, Writer
from solfer.pipes.feedback import Feedback
from solfer.pipes.messages import Message, PointsMessage, VectorMessage, WrenchMessage
from solfer.pipes.names import NameOrder


class PointFeedback(Feedback):
    """Writes what others tell to an input of the component.

    Args:
        name: Name of the pipe in the configuration.
        reader: Where the messages come from.
        port: The input.
        frame: Frame whose axes the numbers have to be in.
        names: Names of several Points, in the order of the port; None: the sender's order.
        required: Whether the plugin has to wait for this pipe before it starts.
        known: Names that a message may bring besides; None: any.

    Attributes:
        what: What the names are those of.
    """

    what = "Point"

    def __init__(
        self,
        name: str,
        reader: Reader,
        port: Port,
        frame: str,
        names: tuple[str, ...] | None = None,
        required: bool = True,
        known: Collection[str] | None = (),
    ):
        super().__init__(name, reader, required)
        self._port, self._frame = port, frame
        self._names = None if names is None else NameOrder(names, known, self.what)
        self._oriented = port.quantity in ("orientation", "pose")
        self._values, self._flags = np.zeros_like(port.value), np.zeros(port.value.shape, dtype=bool)

    @property
    def lacks(self) -> str:
        """See `Feedback.lacks`."""
        absent, whole = [] if self._names is None else self._names.absent(), super().lacks
        return f"{', '.join(absent)} of {whole}" if 0 < len(absent) < len(self._values) else whole

    def run(self) -> Status:
        """See `Feedback.run`."""
        status = super().run()
        self._port.fresh = status is Status.NEW
        if status is Status.NEW:
            np.copyto(self._port.value, self._values)
        return status

    def restart(self) -> None:
        """See `Feedback.restart`."""
        super().restart()
        if self._names is not None:
            self._names.forget()

    def _complete(self) -> bool:
        return self._names is None or not self._names.unheard.any()

    def _decode(self, message: Message) -> None:
        if message.frame != self._frame:
            raise PipeError(f"numbers in the axes of '{message.frame}'", expected=f"axes of '{self._frame}'")
        if isinstance(message, WrenchMessage):
            self._values[:3], self._values[3:] = message.force, message.torque
        elif self._names is None:
            self._check_size(message.values.shape, self._values.shape)
            np.copyto(self._values, message.values)
        else:
            self._take_named(message)
        if not all_finite(self._values, self._flags):
            raise NotFinite(f"a {self._port.quantity} that is not finite")
        if self._oriented:
            require_unit(self._values[..., -4:])

    def _take_named(self, message: PointsMessage) -> None:
        """Take several Points; those that the message lacks keep their values."""
        order = self._names.match(message.names)
        self._check_size(message.values.shape, (len(message.names), self._values.shape[1]))
        if order.target is None:
            message.values.take(order.source, axis=0, out=self._values, mode="clip")
        else:
            np.copyto(self._values, self._port.value)
            self._values[order.target] = message.values[order.source]
        if not self.heard:
            self._names.note(order)

    @staticmethod
    def _check_size(shape: tuple[int, ...], wanted: tuple[int, ...]) -> None:
        if shape != wanted:
            raise PipeError(f"numbers of shape {shape}", expected=f"shape {wanted}")


class PointController(Controller):
    """Tells an output of the component; numbers that are not finite are not sent.

    Args:
        name: Name of the pipe in the configuration.
        writer: Where the messages go.
        port: The output.
        frame: Frame whose axes the numbers are in.
        names: Names of several Points; None: they have none.
    """

    def __init__(self, name: str, writer: Writer, port: Port, frame: str, names: tuple[str, ...] | None = None):
        self._port, self._throttle = port, Throttle(logging.getLogger(__name__))
        self._values = np.zeros_like(port.value)
        self._finite = True
        if port.count is not None:
            super().__init__(name, writer, PointsMessage(frame, names or (), self._values))
        elif port.quantity == "wrench":
            super().__init__(name, writer, WrenchMessage(frame, self._values[:3], self._values[3:]))
        else:
            super().__init__(name, writer, VectorMessage(frame, self._values))

    def collect(self) -> None:
        """See `Controller.collect`."""
        np.copyto(self._values, self._port.value)
        self._finite = bool(np.isfinite(self._values).all())

    def send(self, stamp: float) -> None:
        """See `Controller.send`."""
        if self._finite:
            super().send(stamp)
        else:
            self._throttle.warning("finite", "controller '%s': a %s that is not finite is not sent", self.name,
                                   self._port.quantity)

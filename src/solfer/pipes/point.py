"""Pipes that carry Robot Points between plugins: from a port of one component to that of another."""

import logging

import numpy as np

from solfer.components.port import Port
from solfer.errors import NotFinite, PipeError
from solfer.logs import Throttle
from solfer.numerics.rotations import require_unit
from solfer.pipes.controller import Controller
from solfer.pipes.endpoints import Reader, Status, Writer
from solfer.pipes.feedback import Feedback
from solfer.pipes.messages import Message, PointsMessage, VectorMessage, WrenchMessage


class PointFeedback(Feedback):
    """Writes what others tell to an input of the component.

    Args:
        name: Name of the pipe in the configuration.
        reader: Where the messages come from.
        port: The input.
        frame: Frame whose axes the numbers have to be in.
        names: Names of several Points, in the order of the port; None: the sender's order.
        required: Whether the plugin has to wait for this pipe before it starts.
    """

    def __init__(
        self,
        name: str,
        reader: Reader,
        port: Port,
        frame: str,
        names: tuple[str, ...] | None = None,
        required: bool = True,
    ):
        super().__init__(name, reader, required)
        self._port, self._frame, self._names = port, frame, names
        self._oriented = port.quantity in ("orientation", "pose")
        self._values = np.zeros_like(port.value)

    def run(self) -> Status:
        """See `Feedback.run`."""
        status = super().run()
        self._port.fresh = status is Status.NEW
        if status is Status.NEW:
            np.copyto(self._port.value, self._values)
        return status

    def _decode(self, message: Message) -> None:
        if message.frame != self._frame:
            raise PipeError(f"numbers in the axes of '{message.frame}'", expected=f"axes of '{self._frame}'")
        if isinstance(message, WrenchMessage):
            self._values[:3], self._values[3:] = message.force, message.torque
        else:
            values = message.values
            if isinstance(message, PointsMessage) and self._names not in (None, message.names):
                values = values[self._order(message.names)]
            if values.shape != self._values.shape:
                raise PipeError(f"numbers of shape {values.shape}", expected=f"shape {self._values.shape}")
            np.copyto(self._values, values)
        if not np.isfinite(self._values).all():
            raise NotFinite(f"a {self._port.quantity} that is not finite")
        if self._oriented:
            require_unit(self._values[..., -4:])

    def _order(self, names: tuple[str, ...]) -> list[int]:
        missing = [name for name in self._names if name not in names]
        if missing or len(set(names)) < len(names):
            raise PipeError(f"Points {', '.join(names)}", expected=f"{', '.join(self._names)}, each once")
        return [names.index(name) for name in self._names]


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

"""What lies between a simulated robot and its plugins: encoders and delays."""

import dataclasses
import logging
from collections.abc import Callable, Collection, Container, Sequence
from typing import Any

from solfer.errors import UnknownName
from solfer.interfaces.declaration import Service
from solfer.simulation.delay_line import DelayLine
from solfer.simulation.mock_hardware.encoders import Encoders
from solfer.throttle import Throttle
from solfer.transport.endpoints import NullWriter, Queue, Writer
from solfer.transport.lower_level import CLAIM_INTERFACE
from solfer.transport.messages import JOINT_MESSAGES, JointMessage, Message, copied
from solfer.transport.middleware import CONTROLLER_GAINS, JOINT_NAMES, Middleware, Submit
from solfer.transport.passing_on import PassingMiddleware


class Wiring(PassingMiddleware):
    """The Middleware of a SimulationServer, between it and the outside.

    Args:
        outside: The way to the plugins.
        encoders: Names and numbers of the joints.
        controllers: Owners of the services that hardware offers.
        measurement: Cycles between a measurement and its arrival outside.
        command: Cycles between a command's arrival here and in its controller.
        truth: Topics that no sensor of a robot could measure; they are not published.

    Attributes:
        cycle: Number of the present cycle; `advance` ends it.
    """

    def __init__(
        self,
        outside: Middleware,
        encoders: Encoders,
        controllers: Collection[str],
        measurement: int,
        command: int,
        *,
        truth: Container[str],
    ):
        super().__init__(outside)
        self._encoders = encoders
        self._controllers = set(controllers)
        self._measurement = measurement
        self._command = command
        self._truth = truth
        self._writers: list[_LateWriter] = []
        self.cycle = 0

    def advance(self) -> None:
        """Deliver the measurements that are due, and go on to the next cycle."""
        for writer in self._writers:
            writer.deliver()
        self.cycle += 1

    def writer(self, topic: str, message: str) -> Writer:
        """Return a writer of measurements, which are delayed."""
        if topic in self._truth:
            return NullWriter(topic)
        encode = self._encoders.measured if message in JOINT_MESSAGES else copied
        writer = _LateWriter(self, self._outside.writer(topic, message), encode, line=DelayLine(self._measurement))
        self._writers.append(writer)
        return writer

    def queue(self, topic: str, message: str, size: int = 64, largest: int | None = None) -> Queue:
        """Return a queue of commands for joints, which are delayed."""
        outside = self._outside.queue(topic, message, size, largest)
        return _LateQueue(self, outside, self._encoders, line=DelayLine(self._command))

    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """Offer the services of the controllers, with the hardware's joint names; a simulator's own are left out."""
        if owner in self._controllers:
            self._outside.serve(owner, [self._translated(service) for service in services], submit)

    def publish_time(self, simulated: float) -> None:
        """See `Middleware.publish_time`; no effect, a robot does not publish the time."""

    def _translated(self, service: Service) -> Service:
        encoders = self._encoders

        def handler(request: Any) -> Any:
            if service.interface == CLAIM_INTERFACE and request.positions:
                request = dataclasses.replace(request, positions=encoders.positions(request.joints, request.positions))
            reply = service.handler(_renamed(request, ("joints",), encoders.joint))
            if service.interface == JOINT_NAMES:
                return dataclasses.replace(reply, names=encoders.ordered(reply.names))
            if service.interface == CONTROLLER_GAINS:
                return dataclasses.replace(reply, names=tuple(map(encoders.name, reply.names)))
            return _renamed(reply, ("joints",), lambda text: " ".join(map(encoders.name, text.split())))

        return dataclasses.replace(service, handler=handler)


class _LateWriter(Writer):
    """Writes measurements with a delay."""

    def __init__(self, wiring: Wiring, outside: Writer, encode: Callable[[Any], Message], line: DelayLine[Message]):
        self.topic = outside.topic
        self._wiring = wiring
        self._outside = outside
        self._encode = encode
        self._line = line

    def write(self, message: Message) -> None:
        """See `Writer.write`."""
        self._line.put(self._wiring.cycle, self._encode(message))

    def deliver(self) -> None:
        """Send what is due."""
        for message in self._line.due(self._wiring.cycle):
            self._outside.write(message)


class _LateQueue(Queue):
    """Receives commands with a delay; those for joints that the hardware does not have are refused."""

    def __init__(self, wiring: Wiring, outside: Queue, encoders: Encoders, line: DelayLine[JointMessage]):
        self.topic = outside.topic
        self._wiring = wiring
        self._outside = outside
        self._encoders = encoders
        self._line = line
        self._throttle = Throttle(logging.getLogger(__name__))

    @property
    def dropped(self) -> int:
        """See `Queue.dropped`."""
        return self._outside.dropped

    def drain(self) -> list[JointMessage]:
        """See `Queue.drain`."""
        return self._late(self._outside.drain())

    def take(self, first: Container[str], most: int, others: int) -> list[JointMessage]:
        """See `Queue.take`; the bounds count for commands that arrive here."""
        return self._late(self._outside.take(first, most, others))

    def _late(self, messages: list[JointMessage]) -> list[JointMessage]:
        for message in messages:
            try:
                self._line.put(self._wiring.cycle, self._encoders.commanded(message))
            except UnknownName as error:
                sender = message.claimant or "an unknown sender"
                self._throttle.warning(sender, "%s: a command of %s is refused: %s", self.topic, sender, error)
        return self._line.due(self._wiring.cycle)


def _renamed(record: Any, fields: tuple[str, ...], rename: Callable[[str], str]) -> Any:
    """Return a request or reply with each text in its lists `fields` renamed."""
    changes = {field: tuple(map(rename, getattr(record, field))) for field in fields if hasattr(record, field)}
    return dataclasses.replace(record, **changes) if changes else record

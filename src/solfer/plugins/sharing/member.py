"""The middleware of one component of a shared plugin: the shared space first, then that of the process."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from typing import Any

from solfer.interfaces.declaration import Service
from solfer.pipes.sharing.local_topic import LocalReader, LocalWriter
from solfer.pipes.sharing.others_reader import OthersReader
from solfer.plugins.sharing.space import SharedSpace, SharedTopic
from solfer.transport.endpoints import Queue, Reader, Writer
from solfer.transport.health import Health
from solfer.transport.messages import TYPES, canonical
from solfer.transport.middleware import HealthReport, Middleware, Submit
from solfer.transport.topics import Topics


class SpaceMember(Middleware):
    """One component's connection to the others of its shared plugin, and to the outside.

    Args:
        component: Name of its plugin.
        space: The shared space.
        outside: The middleware for everything else, also of messages that go out.
    """

    def __init__(self, component: str, space: SharedSpace, outside: Middleware):
        self.component = component
        self._space = space
        self._outside = outside
        # without a call in between: a cycle reads the time often
        self.now = outside.now  # type: ignore[method-assign]

    @property
    def name(self) -> str:
        """See `Middleware.name`."""
        return self._outside.name

    @property
    def rewinds(self) -> int:
        """See `Middleware.rewinds`."""
        return self._outside.rewinds

    @property
    def loss(self) -> str:
        """See `Middleware.loss`."""
        return self._outside.loss

    def now(self) -> float:
        """See `Middleware.now`."""
        return self._outside.now()

    def stamp_time(self) -> float:
        """See `Middleware.stamp_time`."""
        return self._outside.stamp_time()

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`."""
        self._outside.sleep_until(deadline)

    def publish_time(self, simulated: float) -> None:
        """See `Middleware.publish_time`."""
        self._outside.publish_time(simulated)

    def running(self) -> bool:
        """See `Middleware.running`."""
        return self._outside.running()

    def resolve(self, topic: str) -> str:
        """See `Middleware.resolve`."""
        return self._outside.resolve(topic)

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`."""
        return self._outside.parameter(name, where)

    def first_values(self, owner: str) -> Mapping[str, Any]:
        """See `Middleware.first_values`."""
        return self._outside.first_values(owner)

    def reader(self, topic: str, message: str, kept: int = 0) -> Reader:
        """See `Middleware.reader`; what another component of the shared plugin publishes comes from there alone."""
        resolved = self.resolve(topic)
        message = canonical(message)
        channel = self._space.published_to(self.component, resolved, message)
        if channel is not None:
            return LocalReader(topic, channel, self.now)
        outside = self._outside.reader(topic, message, kept)
        own = self._space.published_by(self.component, resolved, message)
        return outside if own is None else OthersReader(outside, (self._outside.name,))

    def queue(self, topic: str, message: str, size: int = 64, largest: int | None = None) -> Queue:
        """See `Middleware.queue`; pipes have none, so that the shared space has none either."""
        return self._outside.queue(topic, message, size, largest)

    def declared_queue(self, topic: str, message: str) -> Queue:
        """See `Middleware.declared_queue`; as `queue`."""
        return self._outside.declared_queue(topic, message)

    def pending(self, queues: Sequence[Queue]) -> Callable[[], bool]:
        """See `Middleware.pending`."""
        return self._outside.pending(queues)

    def require_fields(self, interface: str, message: type) -> None:
        """See `Middleware.require_fields`."""
        self._outside.require_fields(interface, message)

    def writer(self, topic: str, message: str) -> Writer:
        """See `Middleware.writer`; the shared space has the message, too."""
        outside = self._outside.writer(topic, message)
        channel = self._space.published_by(self.component, self.resolve(topic), message)
        return outside if channel is None else LocalWriter(outside, channel, self.now)

    def declared_writer(self, topic: str, message: str) -> Writer:
        """See `Middleware.declared_writer`; pipes of the components behind this one get its messages at once."""
        if message in TYPES:
            self._space.add(SharedTopic(self.component, self.resolve(topic), message))
        return self.writer(topic, message)

    def joint_order(self, topic: str, message: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.joint_order`; a component that comes earlier in the list has prepared its message."""
        channel = self._space.published_to(self.component, self.resolve(topic), canonical(message, where))
        if channel is not None and channel.message is not None:
            return channel.message.names
        return self._outside.joint_order(topic, message, timeout, where)

    def controller_joints(self, controller: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.controller_joints`."""
        return self._outside.controller_joints(controller, timeout, where)

    def controller_gains(self, controller: str, timeout: float, where: str = "") -> dict[str, tuple[float, float]]:
        """See `Middleware.controller_gains`."""
        return self._outside.controller_gains(controller, timeout, where)

    def _first_order(self, topic: str, message: str, timeout: float) -> tuple[str, tuple[str, ...] | None]:
        """See `Middleware._first_order`."""
        return self._outside._first_order(topic, message, timeout)

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """See `Middleware.call`."""
        return self._outside.call(name, interface, request, reply, timeout)

    def request(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """See `Middleware.request`."""
        return self._outside.request(name, interface, request, reply, timeout)

    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """See `Middleware.serve`."""
        self._outside.serve(owner, services, submit)

    def topics(self) -> "Future[Topics]":
        """See `Middleware.topics`."""
        return self._outside.topics()

    def report(self, name: str, level: Health, summary: str, values: Mapping[str, float | str]) -> None:
        """See `Middleware.report`."""
        self._outside.report(name, level, summary, values)

    def reports(self) -> Mapping[str, HealthReport]:
        """See `Middleware.reports`."""
        return self._outside.reports()

    def close(self) -> None:
        """See `Middleware.close`: the process closes its own."""

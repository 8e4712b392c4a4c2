"""The middleware of one component of a shared plugin: the shared space first, then that of the process."""

from solfer.pipes.sharing.local_topic import LocalReader, LocalWriter
from solfer.pipes.sharing.others_reader import OthersReader
from solfer.plugins.sharing.space import SharedSpace, SharedTopic
from solfer.transport.endpoints import Reader, Writer
from solfer.transport.messages import TYPES, canonical
from solfer.transport.middleware import Middleware
from solfer.transport.passing_on import PassingMiddleware


class SpaceMember(PassingMiddleware):
    """One component's connection to the others of its shared plugin, and to the outside.

    Args:
        component: Name of its plugin.
        space: The shared space.
        outside: The middleware for everything else, also of messages that go out.
    """

    def __init__(self, component: str, space: SharedSpace, outside: Middleware):
        super().__init__(outside)
        self.component = component
        self._space = space

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

    def close(self) -> None:
        """See `Middleware.close`: the process closes its own."""

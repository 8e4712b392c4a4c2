"""The simulation's side of lock-step."""

import logging
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait

from solfer.errors import MiddlewareError
from solfer.throttle import Throttle
from solfer.transport.lockstep.client import (
    Endpoint,
    LockstepCall,
    LockstepNetwork,
    Numbers,
    Tick,
    published_counts,
    wait_for_connections,
    wait_for_messages,
)
from solfer.transport.lockstep.step_clock import TIME_TOLERANCE

logger = logging.getLogger(__name__)


class LockstepMember:
    """One node that follows, as the simulation sees it.

    Args:
        name: Full name of the node.
        network: Middleware of the simulation.

    Attributes:
        name: Full name of the node.
        due: Simulated time of its next cycle [s].
        before: Numbers of the messages that were sent before it was there; it need not have received them.
    """

    def __init__(self, name: str, network: LockstepNetwork):
        self.name = name
        self.due = 0.0
        self.before: Numbers = {}
        self._network = network
        self._call: LockstepCall | None = None
        self._thread = ThreadPoolExecutor(1)

    @property
    def there(self) -> bool:
        """Whether the node follows at present."""
        return self._call is not None

    def join(self, numbers: Numbers) -> bool:
        """Connect to the node if it is there; returns whether it is."""
        self._call = self._network.connect(self.name)
        if self._call is None:
            return False
        self.due = 0.0
        self.before = numbers
        return True

    def tick(self, now: float, numbers: Numbers, meanwhile: Callable[[], None], running: Callable[[], bool]) -> Numbers:
        """Let the node make its cycle; returns the numbers of its newest messages. A node that is gone leaves.

        Args:
            now: Simulated time [s].
            numbers: Newest messages of all.
            meanwhile: Called again and again until the node has answered.
            running: False when there is no reason to wait any more.
        """
        received = {key: number for key, number in numbers.items() if number != self.before.get(key, 0)}
        tick = Tick(
            now,
            [topic for topic, _ in received],
            [sender for _, sender in received],
            list(received.values()),
            [self.before.get(key, 0) for key in received],
        )
        answer = self._thread.submit(self._call, tick)
        warning_period = 2.0  # [s]
        next_warning = time.monotonic() + warning_period
        while not wait((answer,), 1e-3).done and running():
            meanwhile()
            if time.monotonic() > next_warning:
                next_warning += warning_period
                logger.warning("lock-step: time stands still until %s has made its cycle", self.name)
        if not answer.done():
            return {}
        try:
            reply = answer.result()
        except MiddlewareError as error:
            logger.warning("lock-step: %s is gone: %s", self.name, error)
            self._leave()
            return {}
        self.due = reply.next
        return {(topic, self.name): number for topic, number in zip(reply.topics, reply.numbers, strict=True)}

    def close(self) -> None:
        """Close the connection to the node."""
        self._leave()
        self._thread.shutdown(wait=False)

    def _leave(self) -> None:
        if self._call is not None:
            self._call.close()
            self._call = None


class LockstepServer:
    """Lets nodes follow a simulation in lock-step; see `solfer.simulation.Followers`.

    Args:
        names: Full names of the nodes, in the order of their cycles.
        network: Middleware of the node that simulates.
        endpoints: Its topics; a live list.
        running: False as soon as the end was requested.
    """

    def __init__(
        self,
        names: Sequence[str],
        network: LockstepNetwork,
        endpoints: Sequence[Endpoint],
        running: Callable[[], bool],
    ):
        self._members = [LockstepMember(each, network) for each in names]
        self._network = network
        self._endpoints = endpoints
        self._running = running
        self._numbers: Numbers = {}
        self._throttle = Throttle(logger)

    def present(self) -> bool:
        """Return whether all nodes are there, after a search for those that are not."""
        missing = [member for member in self._members if not member.there]
        for member in missing:
            if member.join(dict(self._newest())):
                wait_for_connections(self._endpoints, self._network, self._running)
                logger.info("lock-step: %s is there", member.name)
        away = [member.name for member in missing if not member.there]
        if away:
            self._throttle.warning("away", "lock-step: time stands still until %s is there", ", ".join(away))
        return not away

    def follow(self, now: float, meanwhile: Callable[[], None]) -> None:
        """Return when the nodes have made the cycles that are due at `now` [s], and what they sent has arrived here."""
        due = [member for member in self._members if member.there and now >= member.due - TIME_TOLERANCE]
        for member in due:
            published = member.tick(now, self._newest(), meanwhile, self._running)
            if not member.there:
                self._forget(member.name)
            self._numbers |= published
        if due and self._running():
            wait_for_messages(self._endpoints, self._numbers, self._running)

    def close(self) -> None:
        """Let the nodes go."""
        for member in self._members:
            member.close()

    def _forget(self, name: str) -> None:
        """Forget the numbers of a node: when it comes back it counts its messages from the beginning."""
        for numbers in (self._numbers, *(member.before for member in self._members)):
            for key in [key for key in numbers if key[1] == name]:
                del numbers[key]

    def _newest(self) -> Numbers:
        """Return the numbers of the newest messages of all, those of this node included."""
        for topic, number in published_counts(self._endpoints).items():
            self._numbers[topic, self._network.name] = number
        return self._numbers

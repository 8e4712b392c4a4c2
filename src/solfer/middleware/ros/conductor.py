"""The simulation's side of lock-step."""

import logging
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait

import rospy

from solfer.logs import Throttle
from solfer.middleware.ros.calls import alive, provider
from solfer.middleware.ros.interfaces import service_class
from solfer.middleware.ros.lockstep import (
    SERVICE,
    TICK,
    Endpoint,
    Numbers,
    said,
    wait_for_connections,
    wait_for_messages,
)
from solfer.middleware.ros.step_clock import CLOSE

logger = logging.getLogger(__name__)

ANSWER = 1e-3
"""Time between two looks at other requests while a follower makes its cycle [s]."""

SLOW = 2.0
"""Time of a cycle from which on the follower is named [s]."""


class Attendant:
    """One node that follows, as the simulation sees it.

    Args:
        name: Full name of the node.

    Attributes:
        name: Full name of the node.
        due: Simulated time of its next cycle [s].
        before: Numbers of the messages that were sent before it was there; it need not have heard them.
    """

    def __init__(self, name: str):
        self.name, self.due = name, 0.0
        self.before: Numbers = {}
        self._service = f"{name}/{SERVICE}"
        self._proxy: rospy.ServiceProxy | None = None
        self._thread = ThreadPoolExecutor(1)

    @property
    def there(self) -> bool:
        """Whether the node follows at present."""
        return self._proxy is not None

    def join(self, numbers: Numbers) -> bool:
        """Look whether the node is there; whether it has come just now."""
        uri = provider(self._service)
        if uri is None or not alive(self._service, uri):
            return False
        self._proxy, self.due, self.before = rospy.ServiceProxy(self._service, service_class(TICK), True), 0.0, numbers
        return True

    def tick(self, now: float, numbers: Numbers, meanwhile: Callable[[], None], running: Callable[[], bool]) -> Numbers:
        """Let the node make its cycle; what it has said so far. A node that is gone is not there any more.

        Args:
            now: Simulated time [s].
            numbers: Newest messages of all.
            meanwhile: Called again and again until the node has answered.
            running: False when nobody needs to wait any more.
        """
        heard = {key: number for key, number in numbers.items() if number != self.before.get(key, 0)}
        request = service_class(TICK)._request_class(
            now, [topic for topic, _ in heard], [sender for _, sender in heard], list(heard.values()))
        answer, slow = self._thread.submit(self._proxy, request), time.monotonic() + SLOW
        while not wait((answer,), ANSWER).done and running():
            meanwhile()
            if time.monotonic() > slow:
                slow += SLOW
                logger.warning("lock-step: time stands still until %s has made its cycle", self.name)
        if not answer.done():
            return {}
        try:
            reply = answer.result()
        except (rospy.ServiceException, rospy.ROSException, OSError) as error:
            logger.warning("lock-step: %s is gone: %s", self.name, error)
            self._leave()
            return {}
        self.due = reply.next
        return {(topic, self.name): number for topic, number in zip(reply.topics, reply.numbers, strict=True)}

    def close(self) -> None:
        """Ask the node no more."""
        self._leave()
        self._thread.shutdown(wait=False)

    def _leave(self) -> None:
        if self._proxy is not None:
            self._proxy.close()
            self._proxy = None


class Conductor:
    """Lets nodes follow a simulation in lock-step; see `solfer.simulation.Followers`.

    Args:
        names: Full names of the nodes, in the order of their cycles.
        name: Name of the node that simulates.
        endpoints: Its topics; a live list.
        running: False as soon as somebody asked for the end.
    """

    def __init__(self, names: Sequence[str], name: str, endpoints: Sequence[Endpoint], running: Callable[[], bool]):
        self._attendants = [Attendant(each) for each in names]
        self._name, self._endpoints, self._running = name, endpoints, running
        self._numbers: Numbers = {}
        self._throttle = Throttle(logger)

    def present(self) -> bool:
        """Whether all nodes are there; looks for those that are not."""
        missing = [attendant for attendant in self._attendants if not attendant.there]
        for attendant in missing:
            if attendant.join(dict(self._speak())):
                wait_for_connections(self._endpoints, self._name, self._running)
                logger.info("lock-step: %s is there", attendant.name)
        away = [attendant.name for attendant in missing if not attendant.there]
        if away:
            self._throttle.warning("away", "lock-step: time stands still until %s is there", ", ".join(away))
        return not away

    def follow(self, now: float, meanwhile: Callable[[], None]) -> None:
        """Return when the nodes have made the cycles that are due at `now` [s], and what they sent has arrived here."""
        due = [attendant for attendant in self._attendants if attendant.there and now >= attendant.due - CLOSE]
        for attendant in due:
            said_now = attendant.tick(now, self._speak(), meanwhile, self._running)
            if not attendant.there:
                self._forget(attendant.name)
            self._numbers |= said_now
        if due and self._running():
            wait_for_messages(self._endpoints, self._numbers, self._running)

    def close(self) -> None:
        """Let the nodes go."""
        for attendant in self._attendants:
            attendant.close()

    def _forget(self, name: str) -> None:
        """A node that comes back counts its messages from the beginning."""
        for numbers in (self._numbers, *(attendant.before for attendant in self._attendants)):
            for key in [key for key in numbers if key[1] == name]:
                del numbers[key]

    def _speak(self) -> Numbers:
        """Newest messages of all, those of this node included."""
        for topic, number in said(self._endpoints).items():
            self._numbers[topic, self._name] = number
        return self._numbers

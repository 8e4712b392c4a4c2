"""The nodes that are about to publish on a topic, and have not published yet."""

from collections.abc import Callable, Container
from concurrent.futures import Future, wait

import rosgraph
import rospy

from solfer.transport.endpoints import PUBLISHER_TIMEOUT
from solfer.transport.threaded_calls import in_thread


class ExpectedPublishers:
    """The nodes that are registered or connected as publishers, and since when.

    Connections show those that are there; the master knows those that are about to connect, and is called once per
    `PUBLISHER_TIMEOUT` at most.

    Args:
        topic: Resolved name of the topic.
        connected: Returns the names of those that are connected.
        now: Clock by which nodes are known [s]; the machine's, unless in lock-step: a process that was killed stays
            registered, and a simulation may pause.
        timeout: Longest wait for the answer of the master in one call [s].
    """

    UNNAMED = "a node that the ROS master has not named yet"
    """What is listed while the master has not answered."""

    def __init__(self, topic: str, connected: Callable[[], set[str]], now: Callable[[], float], timeout: float):
        self._topic = topic
        self._connected = connected
        self._now = now
        self._timeout = timeout
        self._since: dict[str, float] = {}
        self._registered: set[str] = set()
        self._checked = -PUBLISHER_TIMEOUT
        self._answer: Future[set[str]] | None = None

    def awaited(self, published: Container[str]) -> list[str]:
        """List the nodes that have been known for less than PUBLISHER_TIMEOUT and are not among `published`, sorted."""
        now = self._now()
        self._check(now)
        present = self._connected() | self._registered
        self._since = {name: self._since.get(name, now) for name in present}
        return sorted(name for name in present if name not in published and now - self._since[name] < PUBLISHER_TIMEOUT)

    def _check(self, now: float) -> None:
        """Bring the registered publishers up to date."""
        if self._answer is None:
            if now - self._checked < PUBLISHER_TIMEOUT:
                return
            self._checked = now
            self._answer = in_thread(lambda: _registered(self._topic))
            wait((self._answer,), self._timeout)
        answer = self._answer
        if not answer.done():
            self._registered = self._registered | {self.UNNAMED}
            return
        self._answer = None
        # without a master no new node can connect
        self._registered = set() if answer.exception() else answer.result()


def _registered(topic: str) -> set[str]:
    """Look up the other nodes that publish a topic."""
    publishers, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
    return {name for each, names in publishers if each == topic for name in names} - {rospy.get_name()}

"""Health reports on /diagnostics."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from solfer.middleware.ros.node.master import call_master, require_master
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport

FIRST_REPORTS = 2.5, 10.0
"""Time in which each node reports each of its parts, and the longest for nodes that have reported nothing yet [s]."""


@contextmanager
def watched() -> Iterator[Callable[[], Mapping[str, HealthReport]]]:
    """Watch the health reports of all nodes, from when each has reported, in a program that is no node otherwise.

    Raises:
        MiddlewareError: The ROS master does not answer.
    """
    require_master()
    rospy.init_node("solfer_top", anonymous=True, disable_signals=True, disable_rostime=True)
    diagnostics = Diagnostics(rospy.get_name())
    try:
        diagnostics.await_reports(*FIRST_REPORTS)
        yield diagnostics.reports
    finally:
        diagnostics.close()
        rospy.signal_shutdown("end")


class Diagnostics:
    """Publishes the health of the parts of a node; a change of level goes out at once.

    Args:
        node: Name of the node, the first half of every status' name.
    """

    PERIOD = 1.0
    """Shortest time between two reports of one part while its level stays the same [s]."""

    def __init__(self, node: str):
        self._node = node.lstrip("/")
        self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._subscriber: rospy.Subscriber | None = None
        self._last: dict[str, tuple[float, Health]] = {}
        self._received: dict[str, HealthReport] = {}
        self._reporters: set[str] = set()

    def report(self, name: str, level: Health, summary: str, values: Mapping[str, float | str]) -> None:
        """Publish one status; see `Middleware.report`."""
        now = time.monotonic()
        last_time, last_level = self._last.get(name, (-self.PERIOD, level))
        # A report that comes once a period must not be left out because it is a little early.
        if level == last_level and now - last_time < 0.9 * self.PERIOD:
            return
        self._last[name] = (now, level)
        pairs = [
            KeyValue(key, f"{value:.6g}" if isinstance(value, float) else str(value)) for key, value in values.items()
        ]
        status = DiagnosticStatus(level, f"{self._node}: {name}", summary, self._node, pairs)
        message = DiagnosticArray(status=[status])
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)

    def reports(self) -> Mapping[str, HealthReport]:
        """Return the newest report of each part of any node; see `Middleware.reports`."""
        if self._subscriber is None:
            self._subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, self._receive)
        return self._received

    def await_reports(self, shortest: float, longest: float) -> None:
        """Receive reports for `shortest` [s], and up to `longest` while a node that publishes them has sent none."""
        self.reports()
        begin = time.monotonic()
        end = begin + shortest
        while (now := time.monotonic()) < end:
            time.sleep(0.1)
            if self._silent_publishers():
                end = min(begin + longest, max(end, now + 1.0))  # the parts of a node follow its first one

    def _silent_publishers(self) -> set[str]:
        publishers, _, _ = call_master("getSystemState")
        return set(dict(publishers).get(self._publisher.resolved_name, ())) - self._reporters - {rospy.get_name()}

    def _receive(self, message: DiagnosticArray) -> None:
        self._reporters.add(message._connection_header["callerid"])  # other nodes give any name for themselves
        for status in message.status:
            part = status.name.rpartition(": ")[2]
            self._received[part] = HealthReport(
                Health(min(status.level, Health.ERROR)),
                status.message,  # stale is no level of ours
                {pair.key: pair.value for pair in status.values},
            )

    def close(self) -> None:
        """Unregister."""
        self._publisher.unregister()
        if self._subscriber is not None:
            self._subscriber.unregister()

"""Publishes the statistics of a real-time layer on xbotcore/statistics, and its health on /diagnostics."""

import logging
import threading
from collections.abc import Callable, Sequence
from typing import Any

import rospy

from solfer.msg import LayerStatistics, PluginStatistics, StageTimes
from solfer.telemetry.statistics import EXECUTOR
from solfer.telemetry.summaries import LayerSummary, PluginSummary, StageSummary, reports_of
from solfer.transport import Middleware

logger = logging.getLogger(__name__)


class StatisticsPublisher:
    """Reads the statistics of a layer once a second, in a thread of its own, and publishes them.

    Args:
        look: Reads the figures of the layer; None while there is none.
        middleware: Where health is reported.
        period: Time between two messages [s].
    """

    def __init__(self, look: Callable[[], LayerSummary | None], middleware: Middleware, period: float = 1.0):
        self._look = look
        self._middleware = middleware
        self._period = period
        self._before: LayerSummary | None = None
        self._publisher = rospy.Publisher(f"{EXECUTOR}/statistics", LayerStatistics, queue_size=1)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def cycle(self) -> None:
        """Read the statistics once and publish them."""
        figures = self._look()
        before = self._before
        self._before = None
        for name, report in reports_of(figures, before).items():
            self._middleware.report(name, report.level, report.summary, report.values)
        if figures is None:
            return
        self._before = figures
        message = message_of(figures)
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)

    def close(self) -> None:
        """Stop publishing."""
        self._end.set()
        self._thread.join()
        self._publisher.unregister()

    def _run(self) -> None:
        while not self._end.wait(self._period):
            try:
                self.cycle()
            except rospy.ROSException as error:  # the node ends
                logger.debug("statistics are not published: %s", error)
                return


def message_of(figures: Any) -> Any:
    """Convert figures to their message, with the fields that it has."""
    kinds = {LayerSummary: LayerStatistics, PluginSummary: PluginStatistics, StageSummary: StageTimes}
    kind = kinds[type(figures)]
    fields = {name: getattr(figures, name) for name in kind.__slots__ if hasattr(figures, name)}
    for name, value in fields.items():
        if isinstance(value, Sequence) and not isinstance(value, str):
            fields[name] = [message_of(each) for each in value]
    return kind(**fields)

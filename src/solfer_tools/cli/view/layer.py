"""The page's node in a real-time layer."""

from collections.abc import Mapping

from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.realtime.emergency_stop import stopped
from solfer.segments.namespace import Namespace
from solfer.telemetry.summaries import LayerSummary, StatisticsReader, reports_of
from solfer.transport.middleware import HealthReport


class LayerMiddleware(XbotMiddleware):
    """A node that also reports what a layer and its plugins leave to their statistics.

    Args:
        namespace: That of the layer.
        name: Name of the node.
    """

    def __init__(self, namespace: Namespace, name: str):
        super().__init__(namespace, name, listens=False)
        self._statistics = StatisticsReader(namespace.folder, stopped)
        self._before: LayerSummary | None = None
        self._layer: dict[str, HealthReport] = {}
        self._next = self.now()

    def reports(self) -> Mapping[str, HealthReport]:
        """See `Middleware.reports`."""
        if self.now() >= self._next:
            self._next = self.now() + 1.0
            now = self._statistics.look()
            self._layer = reports_of(now, self._before)
            self._before = now
        return {**self._layer, **super().reports()}

"""Health reports in shared memory: the newest of each part."""

import json
import logging
from collections.abc import Mapping

from solfer.errors import MiddlewareError
from solfer.segments.namespace import Namespace
from solfer.segments.segment import Segment
from solfer.segments.slot import Slot
from solfer.segments.text import Text
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport

logger = logging.getLogger(__name__)

REPORT_SIZE = 8192
"""Longest report [B]; figures at its end that do not fit are left out."""


class _Page:
    """The report of one part."""

    def __init__(self, segment: Segment):
        self.segment = segment
        self.slot = Slot(segment.data, Text.width(REPORT_SIZE))
        self.text = Text(self.slot.values)


class Reports:
    """The health reports of a namespace, of this node and of others.

    Args:
        namespace: Where.
    """

    KIND = "report"
    FOLDER = "reports"

    def __init__(self, namespace: Namespace):
        self._namespace = namespace
        self._notification = namespace.notification(self.FOLDER)
        self._own: dict[str, _Page | None] = {}
        self._others: dict[str, _Page] = {}
        self._received: dict[str, HealthReport] = {}

    def write(self, name: str, report: HealthReport, time: float) -> None:
        """Report the health of a part at `time` [s]; if another node does already, only log that once."""
        if name not in self._own:
            self._own[name] = self._open(name)
        page = self._own[name]
        if page is None:
            return
        values = {key: value if isinstance(value, str) else float(value) for key, value in report.values.items()}
        while len(text := json.dumps([report.level, report.summary, values]).encode()) > REPORT_SIZE:
            if not values:
                text = json.dumps([report.level, report.summary[: REPORT_SIZE // 8], {}]).encode()
                break
            values.popitem()
        page.text.write(text)
        page.slot.write(int(1e9 * time))

    def read(self) -> Mapping[str, HealthReport]:
        """Return the newest report of each part, of those that have ended, too."""
        if self._notification.is_pending():
            self._notification.acknowledge()
            self._find()
        for name, page in self._others.items():
            if page.slot.read():
                level, summary, values = json.loads(page.text.read())
                self._received[name] = HealthReport(Health(level), summary, values)
        return self._received

    def close(self) -> None:
        """Stop reporting."""
        for page in filter(None, self._own.values()):
            page.segment.close()
        if self._own:
            self._notification.send()

    def _open(self, name: str) -> _Page | None:
        try:
            path = self._namespace.place(self.FOLDER, name)
            page = _Page(Segment.create(path, self.KIND, name.encode(), size=Slot.size(Text.width(REPORT_SIZE))))
        except MiddlewareError as error:
            logger.warning("the health of '%s' is not reported: %s", name, error)
            return None
        self._notification.send()
        return page

    def _find(self) -> None:
        """Attach the reports of new parts."""
        for name in self._namespace.present(self.FOLDER):
            page = self._others.get(name)
            if page is not None and not page.segment.retired:
                continue
            self._others.pop(name, None)
            try:
                segment = Segment.attach(self._namespace.path(self.FOLDER, name), self.KIND)
            except MiddlewareError as error:
                logger.debug("the health of '%s' is not read: %s", name, error)
                continue
            if segment.owned():
                self._others[name] = _Page(segment)

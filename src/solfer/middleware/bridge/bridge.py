"""Carries topics and services over the border between a real-time layer and the rest."""

import logging
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from solfer.errors import SolferError
from solfer.middleware.bridge.routes import Route
from solfer.middleware.bridge.services import ServiceForward, ServiceForwarder
from solfer.middleware.bridge.topics import ForwardedTopic
from solfer.throttle import Throttle
from solfer.transport.fixed_rate import FixedRateLoop
from solfer.transport.health import Health
from solfer.transport.middleware import Middleware

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class BridgeSearch:
    """What a bridge finds at present inside; called every `Bridge.SEARCH_PERIOD` with the names that may be left out.

    Attributes:
        offers: Returns the services that are offered.
        topics: Returns the topics that are published, besides those that always go out.
        requested: Returns the topics that components declare and receive, besides those that always go in.
    """

    offers: Callable[[Collection[str]], Iterable[ServiceForward]] = lambda known: ()
    topics: Callable[[Collection[str]], Iterable[Route]] = lambda known: ()
    requested: Callable[[Collection[str]], Iterable[Route]] = lambda known: ()


class Bridge:
    """Forwards topics in both directions, and requests from outside to services inside.

    No node waits for it: each side goes on without a bridge, where the messages that it carried grow old.

    Args:
        inside: The real-time layer.
        outside: The other side.
        inwards: Topics that are received outside and published inside.
        outwards: Topics that are received inside and published outside.
        search: Finds what there is besides; None: nothing.
        beside: Forwards what else goes out; called in each cycle, before the topics.

    Attributes:
        crossings: The topics that are forwarded.
        forwarding: The services that are forwarded.
    """

    PERIOD = 0.005
    """Period of the cycle [s]."""

    SEARCH_PERIOD = 0.5
    """Time between two searches for new services and topics [s]."""

    REPORT_PERIOD = 1.0
    """Time between two health reports [s]."""

    def __init__(
        self,
        inside: Middleware,
        outside: Middleware,
        inwards: Sequence[Route],
        outwards: Sequence[Route],
        search: BridgeSearch | None = None,
        *,
        beside: Callable[[], None] = lambda: None,
    ):
        self._inside = inside
        self._outside = outside
        self._search = search or BridgeSearch()
        self._beside = beside
        self.forwarding = ServiceForwarder(inside, outside)
        self._forwards_in: list[ForwardedTopic] = []
        self._forwards_out: list[ForwardedTopic] = []
        self.crossings: dict[str, ForwardedTopic] = {}
        self._open(inwards, outside, inside, forwards=self._forwards_in)
        self._open(outwards, inside, outside, forwards=self._forwards_out)
        self._next_search = self._next_report = -float("inf")
        self._published = 0
        self._reports: dict[str, Any] = {}
        self._throttle = Throttle(logger)

    def cycle(self) -> None:
        """Run one whole cycle, without a pause between its halves."""
        self.receive()
        self.publish()

    def receive(self) -> None:
        """Run the first half of a cycle: topics that go in, and requests; search every `SEARCH_PERIOD`."""
        now = self._outside.now()
        if now >= self._next_search:
            self._next_search = now + self.SEARCH_PERIOD
            self._find()
        for crossing in self._forwards_in:
            crossing.run()
        self.forwarding.run()

    def publish(self) -> None:
        """Run the second half: topics that go out, and replies; every `REPORT_PERIOD` a health report."""
        self._beside()
        for crossing in self._forwards_out:
            crossing.run()
        self._inside.sleep_until(self._inside.now())  # receives what came in, such as replies
        self.forwarding.run()
        now = self._outside.now()
        if now >= self._next_report:
            self._next_report = now + self.REPORT_PERIOD
            self._report()

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Run cycles until the outside ends, or `until` returns true.

        Half a period lies between the halves of a cycle: what the layer answers meanwhile goes out in the same cycle.
        """
        loop = FixedRateLoop(self._outside, 1.0 / self.PERIOD)

        def cycle(_late: float, _skipped: int) -> None:
            self.receive()
            self._outside.sleep_until(loop.deadline + 0.5 * self.PERIOD)
            self.publish()

        loop.run(cycle, lambda: self._outside.running() and not until())

    def close(self) -> None:
        """Refuse the requests that still wait."""
        self.forwarding.close()

    def _open(
        self, routes: Iterable[Route], source: Middleware, target: Middleware, forwards: list[ForwardedTopic]
    ) -> None:
        """Start forwarding topics from `source` to `target`; one that crosses already stays as it is."""
        for route in routes:
            if route.topic not in self.crossings:
                forwards.append(ForwardedTopic(route, source, target))
                self.crossings[route.topic] = forwards[-1]

    def _find(self) -> None:
        """Start forwarding topics and services that are new inside since the last search."""
        try:
            self._open(self._search.topics(self.crossings), self._inside, self._outside, forwards=self._forwards_out)
            self._open(self._search.requested(self.crossings), self._outside, self._inside, forwards=self._forwards_in)
            self.forwarding.offer(self._search.offers(self.forwarding.names))
        except SolferError as error:
            self._throttle.warning("look", "something is not forwarded: %s", error)

    def _report(self) -> None:
        refused = sum(crossing.refused for crossing in self.crossings.values())
        news = refused - self._published
        self._published = refused
        values: dict[str, float | str] = {
            "messages refused": refused,
            "services": len(self.forwarding.names),
            "requests": self.forwarding.requests,
        }
        for direction, crossings in (("in", self._forwards_in), ("out", self._forwards_out)):
            for crossing in crossings:
                values[f"{direction} {crossing.topic}"] = f"{crossing.passed} passed, {crossing.dropped} dropped"
        for name, report in self._inside.reports().items():
            if self._reports.get(name) is not report:  # what has ended is not reported again
                self._reports[name] = report
                self._outside.report(name, report.level, report.summary, report.values)
        level, summary = (Health.WARNING, f"{news} messages refused") if news else (Health.GOOD, "running")
        self._outside.report("xbot_bridge", level, summary, values)

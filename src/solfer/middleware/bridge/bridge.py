"""Carries topics and services over the border between a real-time layer and the rest."""

import logging
from collections.abc import Callable, Collection, Iterable, Sequence

from solfer.errors import SolferError
from solfer.logs import Throttle
from solfer.middleware.bridge.crossing import Crossing
from solfer.middleware.bridge.forwarding import Forwarding, Offer
from solfer.middleware.bridge.routes import Route
from solfer.pipes.middleware import Middleware

logger = logging.getLogger(__name__)

PERIOD = 0.005
"""Time between two turns of the bridge [s]."""

LOOK = 0.5
"""Time between two looks for services and topics that are new [s]."""

REPORT = 1.0
"""Time between two health reports [s]."""

HEALTH = "xbot_bridge"
"""Name of the health report."""


class Bridge:
    """Hands topics on in both directions, and requests from outside to services inside.

    Nobody waits for it: each side goes on without a bridge, and what it carried grows old there.

    Args:
        inside: The real-time layer.
        outside: The other side.
        inwards: Topics that are heard outside and told inside.
        outwards: Topics that are heard inside and told outside.
        offers: Services that are offered inside at present; asked for again and again, with the names of those that are
            known already and may be left out.
        topics: Topics that are told inside at present, besides `outwards`; asked for in the same way.
        beside: What else goes out; called in each turn, before the topics.

    Attributes:
        crossings: The topics that are handed on.
        forwarding: The services that are handed on.
    """

    def __init__(self, inside: Middleware, outside: Middleware, inwards: Sequence[Route], outwards: Sequence[Route],
                 offers: Callable[[Collection[str]], Iterable[Offer]] = lambda known: (),
                 topics: Callable[[Collection[str]], Iterable[Route]] = lambda known: (),
                 beside: Callable[[], None] = lambda: None):
        self._inside, self._outside, self._offers, self._topics = inside, outside, offers, topics
        self._beside = beside
        self.forwarding = Forwarding(inside, outside)
        self._ways_in = [Crossing(route, outside, inside) for route in inwards]
        self._ways_out: list[Crossing] = []
        self.crossings = {crossing.topic: crossing for crossing in self._ways_in}
        self._open(outwards)
        self._next_look = self._next_report = -float("inf")
        self._told, self._reports = 0, {}
        self._throttle = Throttle(logger)

    def cycle(self) -> None:
        """One whole turn, without a pause between its halves."""
        self.take_in()
        self.tell()

    def take_in(self) -> None:
        """The first half of a turn: topics that go in and requests; now and then a look at what is new."""
        now = self._outside.now()
        if now >= self._next_look:
            self._next_look = now + LOOK
            self._look()
        for crossing in self._ways_in:
            crossing.run()
        self.forwarding.run()

    def tell(self) -> None:
        """The second half: topics that go out, and replies; now and then a health report."""
        self._beside()
        for crossing in self._ways_out:
            crossing.run()
        self._inside.sleep_until(self._inside.now())  # takes what came in, such as replies
        self.forwarding.run()
        now = self._outside.now()
        if now >= self._next_report:
            self._next_report = now + REPORT
            self._report()

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Turn until the outside ends, or `until` says so.

        Half a period lies between the halves of a turn: what the layer answers meanwhile goes out in the same turn.
        """
        due = self._outside.now()
        while self._outside.running() and not until():
            self.take_in()
            self._outside.sleep_until(due + 0.5 * PERIOD)
            self.tell()
            due = max(due + PERIOD, self._outside.now())
            self._outside.sleep_until(due)

    def close(self) -> None:
        """Refuse the requests that still wait."""
        self.forwarding.close()

    def _open(self, outwards: Iterable[Route]) -> None:
        for route in outwards:
            if route.topic not in self.crossings:
                self._ways_out.append(Crossing(route, self._inside, self._outside))
                self.crossings[route.topic] = self._ways_out[-1]

    def _look(self) -> None:
        """Take up topics and services that somebody inside offers since the last look."""
        try:
            self._open(self._topics(self.crossings))
            self.forwarding.offer(self._offers(self.forwarding.names))
        except SolferError as error:
            self._throttle.warning("look", "something is not handed on: %s", error)

    def _report(self) -> None:
        refused = sum(crossing.refused for crossing in self.crossings.values())
        news, self._told = refused - self._told, refused
        values: dict[str, float | str] = {
            "messages refused": refused, "services": len(self.forwarding.names), "requests": self.forwarding.requests}
        for way, crossings in (("in", self._ways_in), ("out", self._ways_out)):
            for crossing in crossings:
                values[f"{way} {crossing.topic}"] = f"{crossing.passed} passed, {crossing.dropped} dropped"
        for name, report in self._inside.reports().items():
            if self._reports.get(name) is not report:  # what has ended is told no more
                self._reports[name] = report
                self._outside.report(name, report.level, report.summary, report.values)
        self._outside.report(HEALTH, 1 if news else 0, f"{news} messages refused" if news else "running", values)

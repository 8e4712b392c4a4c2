"""The loop of a navigation: waits for subscribers, moves, pauses, publishes its progress, and ends at rest."""

import logging
from concurrent.futures import Future

from solfer.errors import ComponentError, MiddlewareError
from solfer.interfaces.declaration import Accepted, Service
from solfer.throttle import Throttle
from solfer.transport import Inbox, Middleware
from solfer.transport.fixed_rate import FixedRateLoop
from solfer.transport.messages import FieldsMessage
from solfer.transport.middleware import SWITCH_ONE, Flag
from solfer.transport.topics import Topics
from solfer_tools.navigation.course import Course
from solfer_tools.navigation.lookahead import FADE_TIME

logger = logging.getLogger(__name__)

CONNECTIONS = "connections"
"""What it waits for from the first sight of the subscribers on."""


class _Subscribers:
    """Waits until what is published has subscribers.

    Args:
        middleware: Carries the topics.
        course: Has their writers.

    Attributes:
        begin: Since when it waits [s].
    """

    def __init__(self, middleware: Middleware, course: Course):
        self._middleware = middleware
        self._course = course
        self._topics: Future[Topics] | None = None
        self._are_connected = False
        self._lacked = 0.0
        self.begin = middleware.now()

    def missing(self) -> str:
        """Return which topic has no subscriber; empty once all have had one for a while.

        Raises:
            MiddlewareError: It takes too long.
        """
        if self._are_connected:
            return ""
        now = self._middleware.now()
        if self._topics is None:
            self._topics = self._middleware.topics()
            return "the topics of others"  # which answer in the next cycle at the earliest, on every middleware
        if not self._topics.done():
            return "the topics of others"
        topics = self._topics.result()
        self._topics = None
        if lacking := self._course.unreceived(topics):
            if now - self.begin > 30.0:
                missing = [topics.missing_subscriber(each.topic, each.carries) for each in lacking]
                raise MiddlewareError(
                    "; ".join(each.what for each in missing if each),
                    expected=f"a subscriber of {' or '.join(dict.fromkeys(each.carries for each in lacking))}",
                    names=tuple(dict.fromkeys(name for each in missing if each for name in each.names)),
                )
            self._lacked = now
            return f"a subscriber on {' or '.join(each.topic for each in lacking)}"
        settling = 0.5  # [s], after which all connections are there for certain
        self._are_connected = now - max(self._lacked, self.begin) >= settling
        return "" if self._are_connected else CONNECTIONS


class Navigation:
    """Carries a course out.

    Offers the service `<name>/pause` (`std_srvs/SetBool`) and publishes `<name>/progress`.

    Args:
        middleware: Carries all of it.
        course: What it does.
        name: Of the navigation.
        rate: Cycles per second [Hz].

    Attributes:
        done: Whether the course has come to its end.
        paused: Whether it has been asked to stop until it is asked to go on.
        pace: Fraction of the planned speed that it requests at present.
        elapsed: Time that it has moved, at its planned speed [s].
        waits: What it waits for; empty: nothing.
    """

    PROGRESS_PERIOD = 0.1
    """Time between two messages of progress [s]."""

    def __init__(self, middleware: Middleware, course: Course, name: str, rate: float):
        self._middleware = middleware
        self._course = course
        self._rate = rate
        self._throttle = Throttle(logger, 5.0)
        self._inbox = Inbox()
        self.done = self.paused = False
        self.pace = 0.0
        self.elapsed = 0.0
        self.waits = ""
        self._progress = middleware.writer(f"{name}/progress", "solfer/NavigationProgress")
        self._reported = -self.PROGRESS_PERIOD
        self._number = -1
        self._subscribers = _Subscribers(middleware, course)
        self._went = self._subscribers.begin
        pause = Service("pause", SWITCH_ONE, Flag, reply=Accepted, handler=self._pause)
        middleware.serve(name, (pause,), self._inbox.submit)

    def run(self) -> int:
        """Work until the course or the middleware ends, and leave all at rest; the exit code.

        Raises:
            SolferError: The course cannot go on, or a topic has no subscriber.
        """
        try:
            FixedRateLoop(self._middleware, self._rate).run(
                lambda _, skipped: self.cycle(skipped), lambda: self._middleware.running() and not self.done
            )
        finally:
            for _ in range(5):  # some may be lost
                self._course.rest()
            self._publish_progress()
        if self.done:
            logger.info("at its end after %.1f s", self.elapsed)
        else:
            logger.warning("ended before the end of its way, %.1f s were left", self._course.left)
        return 0 if self.done else 1

    def cycle(self, skipped: int = 0) -> None:
        """Carry out one period, and those that were `skipped` before: the robot has gone on meanwhile."""
        # after more than ten skipped periods the course goes on from where it was
        period = (1 + min(skipped, 10)) / self._rate
        self._inbox.apply()
        self.waits = self._subscribers.missing()
        # a course that asks others has its answers when it begins; one that measures begins with what is new then
        if not self.waits or (self._course.has_dialogue and self.waits == CONNECTIONS):
            self.waits = self._course.awaits() or self.waits
        if self.waits:
            if self._middleware.now() - self._subscribers.begin > 2.0:  # the beginning always takes a while
                self._throttle.warning(self.waits, "waits for %s", self.waits)
            self.pace = 0.0
            self._went = self._middleware.now()
            self._course.rest()
        else:
            change = (0.0 if self.paused else self._course.max_pace) - self.pace
            stop_time = 0.5  # [s], in which the pace goes from 1 to 0 at a pause
            self.pace += min(max(change, -period / stop_time), period / FADE_TIME)
            self.done = not self._course.step(period, self.pace)
            self.elapsed += period * self.pace * self._course.ratio
            self._require_progress()
        self._report()

    def _require_progress(self) -> None:
        """Check that the robot goes on.

        Raises:
            ComponentError: It has not for a long time.
        """
        now = self._middleware.now()
        timeout = 60.0  # [s]
        if self.paused or self._course.ratio >= 0.01:
            self._went = now
        elif now - self._went > timeout:
            raise ComponentError(
                f"the robot has not gone on for {timeout:g} s: its pace is {self._course.ratio:.2f}",
                expected="a motion that the robot can follow; its own log says what holds it",
            )

    def _pause(self, request: Flag) -> Accepted:
        self.paused = request.data
        logger.info("stops" if self.paused else "goes on")
        return Accepted(message=f"{self._course.left:.1f} s left")

    def _report(self) -> None:
        course = self._course
        if course.number != self._number and not self.waits:
            self._number = course.number
            logger.info("%d of %d, %s: %.1f s left", course.number, course.count, course.name, course.left)
        now = self._middleware.now()
        if now - self._reported >= self.PROGRESS_PERIOD or self.done:
            self._reported = now
            self._publish_progress()

    def _publish_progress(self) -> None:
        course = self._course
        self._progress.write(
            FieldsMessage(
                {
                    "number": course.number,
                    "count": course.count,
                    "name": course.name,
                    "elapsed": self.elapsed,
                    "left": 0.0 if self.done else course.left,
                    "pace": self.pace * course.ratio,
                    "paused": self.paused,
                    "done": self.done,
                    "waits": self.waits,
                }
            )
        )

"""What a plugin hears, and what it does when somebody falls silent."""

import logging
from collections.abc import Sequence

from solfer.config import FeedbackRecord
from solfer.pipes import Feedback
from solfer.pipes.endpoints import NEW

logger = logging.getLogger(__name__)

TIMEOUT = 0.2
"""Age of the newest message above which a cycle is a strike, where the configuration says nothing [s]. A simulator on
a shared machine stalls for 20 ms now and then."""

PERIODS = 5
"""The same in periods of the plugin, if these are longer."""

ACTIONS = {
    "keep": "what was said last stays",
    "hold": "the plugin holds until it is back",
    "damp": "the springs of the robot fade out",
    "stop": "the plugin ends",
}
"""What a plugin can do when a feedback is silent, the gravest last, in words."""

GRAVITY = tuple(ACTIONS)


class Watch:
    """One feedback, and how long it may be silent.

    A cycle in which the newest message is older than `timeout` is a strike; after `strikes` of them in a row the pipe
    is silent, until something new comes. Ages count in the pipe's own clock: in a paused simulation nothing ages.

    Args:
        feedback: The pipe.
        timeout: Age above which a cycle is a strike [s].
        strikes: Strikes in a row until the pipe is silent.
        action: What the plugin does then: one of ACTIONS.

    Attributes:
        silent: Whether nothing has come for too long.
        silences: How often that happened.
    """

    def __init__(self, feedback: Feedback, timeout: float, strikes: int, action: str):
        self.feedback, self.action = feedback, action
        self.silent, self.silences = False, 0
        self._timeout, self._strikes, self._count = timeout, strikes, 0
        self._young = False  # whether a message came in time since the start

    @classmethod
    def of(cls, feedback: Feedback, record: FeedbackRecord, rate: float) -> "Watch":
        """The watch that a configuration asks for, in a plugin of a `rate` [Hz]."""
        return cls(feedback, record.timeout or max(TIMEOUT, PERIODS / rate), record.strikes, record.when_silent)

    def run(self, now: float) -> bool:
        """Take over the newest message at the time `now` [s]; whether the plugin can do its work."""
        feedback = self.feedback
        status, late = feedback.run(), now - feedback.arrival > self._timeout
        if status is NEW and not late:
            self._count, self._young = 0, True
            if self.silent:
                self._break_silence()
        elif late:
            self._count += 1
            if self._count == self._strikes:
                self._fall_silent(now)
        if self.silent and self.action != "keep":
            return False
        heard = feedback.heard and (self._young or self.action == "keep")  # nothing begins with what is old
        return heard or not feedback.required

    def restart(self) -> None:
        """Begin anew: what was heard so far does not count."""
        self.feedback.restart()
        self._count, self.silent, self._young = 0, False, False

    def figures(self, now: float) -> dict[str, float | str]:
        """Figures for health reports."""
        feedback = self.feedback
        waits = "waits for it" if feedback.required and not feedback.heard else "not heard yet"
        state = self.action if self.silent else "heard" if feedback.heard else waits
        figures: dict[str, float | str] = {
            f"{feedback.name}": state, f"{feedback.name} messages": feedback.accepted,
            f"{feedback.name} refused": feedback.refused, f"{feedback.name} silences": self.silences}
        if now >= feedback.arrival:
            figures[f"{feedback.name} age [ms]"] = 1e3 * (now - feedback.arrival)
        return figures

    def _fall_silent(self, now: float) -> None:
        self.silent, self.silences = True, self.silences + 1
        feedback = self.feedback
        logger.warning("feedback '%s' (%s): nothing new for %.3f s: %s", feedback.name, feedback.reader.topic,
                       now - feedback.arrival, ACTIONS[self.action])

    def _break_silence(self) -> None:
        self.silent = False
        logger.info("feedback '%s' (%s) is back", self.feedback.name, self.feedback.reader.topic)


class Watches:
    """All feedbacks of a plugin, in the order of the configuration.

    Args:
        watches: One for each feedback.
    """

    def __init__(self, watches: Sequence[Watch]):
        self._watches = tuple(watches)
        self.feedbacks = tuple(watch.feedback for watch in watches)

    def run(self, now: float) -> bool:
        """Take over the newest messages at the time `now` [s]; whether the plugin can do its work."""
        ready = True
        for watch in self._watches:
            if not watch.run(now):
                ready = False
        return ready

    def restart(self) -> None:
        """Begin anew: what was heard so far does not count."""
        for watch in self._watches:
            watch.restart()

    def lacks(self) -> str:
        """The feedbacks without which the plugin does nothing; empty: there is none."""
        return ", ".join(watch.feedback.lacks for watch in self._watches
                         if (watch.silent and watch.action != "keep")
                         or (watch.feedback.required and not watch.feedback.heard))

    def action(self) -> str:
        """The gravest of what silent feedbacks ask for; `keep` if there is none."""
        return max((watch.action for watch in self._watches if watch.silent), key=GRAVITY.index, default="keep")

    def kept(self) -> str:
        """Silent feedbacks whose last words count on; empty: there is none."""
        return ", ".join(watch.feedback.lacks for watch in self._watches if watch.silent and watch.action == "keep")

    def figures(self, now: float) -> dict[str, float | str]:
        """Figures for health reports."""
        return {key: value for watch in self._watches for key, value in watch.figures(now).items()}

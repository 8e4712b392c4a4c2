"""Feedbacks of a plugin, and what it does when one times out."""

import logging
import math
from collections.abc import Iterator, Sequence

from solfer.config import FeedbackRecord
from solfer.pipes import FeedbackPipe
from solfer.transport.endpoints import NEW
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport

logger = logging.getLogger(__name__)

DEFAULT_TIMEOUT = 0.2
"""Default of the age of the newest message above which a cycle is a strike [s]. A simulator on a shared machine stalls
for 20 ms now and then."""

TIMEOUT_PERIODS = 5
"""The same in periods of the plugin; the longer one counts."""

FEEDBACK_FREEZE_TIME = 0.15
"""Time by the stamps without a change of any number after which a feedback is frozen, if joints are to move [s]."""

CONTRADICTION_PATIENCE = 0.3
"""Time after which a feedback of which each message is refused since others contradict it is wrong, and not late [s]:
what it measured last is not kept, whatever its `on_timeout` says."""

ENCODER_STEPS = 5e-3
"""Way that a joint has to be commanded to move meanwhile: several steps of its encoder [rad, m]."""

RECENT = 0.5
"""Time for which a message that is refused or odd is a warning of the plugin's health [s]."""

TIMEOUT_ACTIONS = {
    "keep": "the last message stays valid",
    "hold": "the plugin holds until it is back",
    "damp": "the springs of the robot fade out",
    "stop": "the plugin ends",
}
"""Actions of a plugin when a feedback times out, the gravest last, with their text for the log."""

SEVERITY = tuple(TIMEOUT_ACTIONS)


class NewestChange:
    """The newest change of a feedback's numbers.

    Attributes:
        arrival: When it arrived; infinity: that is not known [s].
        stamp: When it was true, by the sender's clock [s].
        distance: How far joints had been commanded to move until then [rad, m].
    """

    def __init__(self) -> None:
        self.arrival = math.inf
        self.stamp = self.distance = 0.0


class FeedbackTimeout:
    """One feedback, and its timeout.

    A cycle in which the newest message is older than `timeout` is a strike, and so is one in which no measured number
    has changed for long, though joints were commanded to move: it is frozen. After `strikes` of them in a row the pipe
    has timed out, until a new message comes. Ages count in the pipe's own clock: in a paused simulation nothing ages.
    `keep` bridges silence alone: with messages that contradict others the plugin holds.

    Args:
        feedback: The pipe.
        timeout: Age above which a cycle is a strike [s].
        strikes: Strikes in a row until the pipe has timed out.
        action: What the plugin does then: one of TIMEOUT_ACTIONS.
        where: Where the configuration names its topic.

    Attributes:
        timeout: See above.
        timed_out: Whether no message has come for too long.
        timeouts: How often it timed out.
        doubt: Why no plugin may start with the received messages; empty: it may, or this was not checked yet.
    """

    def __init__(self, feedback: FeedbackPipe, timeout: float, strikes: int, action: str, where: str = ""):
        self.feedback = feedback
        self._action = action
        self.where = where
        self.timed_out = False
        self.timeouts = 0
        self.doubt = ""
        self.timeout = timeout
        self._strikes = strikes
        self._count = 0
        self._change = NewestChange()
        self._is_wrong = False
        self._young = False  # whether a message came in time since the start
        self._handovers = feedback.handovers
        self._handed_over = False
        feedback.be_patient(timeout, strikes)

    @classmethod
    def from_record(cls, feedback: FeedbackPipe, record: FeedbackRecord, rate: float) -> "FeedbackTimeout":
        """Make the timeout that a record configures, in a plugin of a `rate` [Hz]."""
        return cls(
            feedback,
            record.timeout or max(DEFAULT_TIMEOUT, TIMEOUT_PERIODS / rate),
            record.strikes,
            action=record.timeout_action,
            where=record.where("source"),
        )

    def read(self, now: float, distance: float = 0.0) -> bool:
        """Read the newest message at the time `now` [s]; return whether nothing is missing or late.

        If not, `serves` reports what that means.

        Args:
            now: The time [s].
            distance: How far joints have been commanded to move so far [rad, m].
        """
        feedback = self.feedback
        status = feedback.run()
        age = now - feedback.arrival
        self._is_wrong = age > CONTRADICTION_PATIENCE and feedback.complaints.contradicts
        late = age > self.timeout or self._is_wrong
        change = self._change
        if feedback.changed != change.arrival:
            change.arrival = feedback.changed
            change.stamp = feedback.stamp
            change.distance = distance
        # in a simulation that pauses the stamps stay, too
        stays = change.arrival < math.inf and feedback.stamp - change.stamp > FEEDBACK_FREEZE_TIME
        frozen = stays and distance - change.distance > ENCODER_STEPS and feedback.measures
        late = late or frozen
        self._handed_over = handed_over = feedback.handovers != self._handovers
        if handed_over:  # another publisher measures another start
            self._handovers = feedback.handovers
            self.restart()
            return False
        if status is NEW and not late:
            self._count = 0
            self._young = True
            if self.timed_out:
                self._recover()
        elif late:
            self._count += 1
            if self._count == self._strikes:
                self._time_out(now, frozen)
        return not self.timed_out and ((feedback.received and self._young) or not feedback.required)

    @property
    def action(self) -> str:
        """What the plugin does at a timeout: one of TIMEOUT_ACTIONS."""
        return "hold" if self._is_wrong and self._action == "keep" else self._action

    def missed(self, running: bool) -> bool:
        """Whether a timeout keeps a plugin that is `running` or not from its work.

        With `keep` a running plugin goes on with the last message, but no plugin starts with it.
        """
        return self.timed_out and (self.action != "keep" or (self.feedback.required and not running))

    def serves(self, running: bool) -> bool:
        """Return whether a plugin that is `running` or not can work with what was read."""
        feedback = self.feedback
        if self._handed_over or self.missed(running):
            return False
        received = feedback.received and (self._young or self.action == "keep")  # nothing starts with an old message
        return received or not feedback.required

    def restart(self) -> None:
        """Begin again: discard all that was received so far."""
        self.feedback.restart()
        self._count = 0
        self.timed_out = False
        self._young = False

    @property
    def lacks(self) -> str:
        """Description of what a plugin waits for: values, and the publisher that is silent, if it is known."""
        feedback = self.feedback
        is_known = self.timed_out and feedback.silent
        return f"{feedback.lacks}, where {feedback.silent} is silent" if is_known else feedback.lacks

    def refusal(self, now: float) -> str:
        """Return why messages were refused, or odd, lately, before the time `now` [s]; empty: none was."""
        place = self.feedback.place
        complaints = self.feedback.complaints
        if complaints.refusal and now - complaints.refused_at < RECENT:
            return f"{place} refuses messages of {complaints.refusal}"
        return f"{place}: {complaints.remark}" if now - complaints.remarked_at < RECENT else ""

    def figures(self, now: float) -> dict[str, float | str]:
        """Return figures for health reports."""
        feedback = self.feedback
        waits = "waits for it" if feedback.required and not feedback.received else "not received yet"
        state = self.action if self.timed_out else "received" if feedback.received else waits
        figures: dict[str, float | str] = {
            f"{feedback.name}": state,
            f"{feedback.name} messages": feedback.accepted,
            f"{feedback.name} refused": feedback.refused,
            f"{feedback.name} ignored": feedback.ignored,
            f"{feedback.name} timeouts": self.timeouts,
        }
        if feedback.dropped:
            figures[f"{feedback.name} dropped"] = feedback.dropped
        if now >= feedback.arrival:
            figures[f"{feedback.name} age [ms]"] = 1e3 * (now - feedback.arrival)
        return figures

    def report(self, now: float) -> HealthReport:
        """Return the health of the pipe at the time `now` [s]; it only reads, for threads beside the loop."""
        feedback = self.feedback
        complaint = self.refusal(now) or self.doubt
        if self.timed_out:
            level = Health.WARNING if self.action == "keep" else Health.ERROR
            summary = f"nothing new on {feedback.reader.topic}: {TIMEOUT_ACTIONS[self.action]}"
        elif feedback.required and not feedback.received:
            level = Health.WARNING
            summary = complaint or f"nothing received on {feedback.reader.topic} yet"
        else:
            level = Health.WARNING if complaint else Health.GOOD
            summary = complaint or ("received" if feedback.received else "not received yet")
        return HealthReport(level, summary, self.figures(now))

    def _time_out(self, now: float, frozen: bool) -> None:
        self.timed_out = True
        self.timeouts = self.timeouts + 1
        feedback = self.feedback
        silent = f" of {feedback.silent}" if feedback.silent else ""
        logger.warning(
            "feedback '%s' (%s): %s for %.3f s: %s",
            feedback.name,
            feedback.reader.topic,
            "no number has changed, though joints were commanded to move," if frozen else f"nothing new{silent}",
            now - (feedback.changed if frozen else feedback.arrival),
            TIMEOUT_ACTIONS[self.action],
        )

    def _recover(self) -> None:
        self.timed_out = False
        logger.info("feedback '%s' (%s) is back", self.feedback.name, self.feedback.reader.topic)


class FeedbackTimeouts:
    """All feedbacks of a plugin, in the order of the configuration.

    Args:
        watches: One for each feedback.

    Attributes:
        feedbacks: The feedbacks.
        complete: Whether nothing was missing or late when they were read last.
    """

    def __init__(self, watches: Sequence[FeedbackTimeout]):
        self._feedback_timeouts = tuple(watches)
        self.feedbacks = tuple(watch.feedback for watch in watches)
        self.complete = False

    def read(self, now: float, distance: float = 0.0) -> None:
        """Read the newest messages, each pipe into its State or the component's input; see `FeedbackTimeout.read`."""
        complete = True
        for watch in self._feedback_timeouts:
            if not watch.read(now, distance):
                complete = False
        self.complete = complete

    def serve(self, running: bool) -> bool:
        """Return whether a plugin that is `running` or not can work with what was read, and has been received."""
        return self.complete or all(watch.serves(running) for watch in self._feedback_timeouts)

    def begins(self, now: float) -> bool:
        """Return whether a plugin may start at the time `now` [s] with what was read.

        Raises:
            OutOfLimits: It would start with a joint outside of its limits.
        """
        ready = self.serve(False)
        for watch in self._feedback_timeouts:
            watch.doubt = watch.feedback.doubt(now) if ready else ""
        if not ready or any(watch.doubt for watch in self._feedback_timeouts):
            return False
        for watch in self._feedback_timeouts:
            watch.feedback.check_start()
        return True

    @property
    def patience(self) -> float:
        """Shortest timeout of a feedback [s]."""
        return min((watch.timeout for watch in self._feedback_timeouts), default=math.inf)

    def restart(self) -> None:
        """Begin again: discard all that was received so far."""
        for watch in self._feedback_timeouts:
            watch.restart()

    def lacks(self, running: bool) -> str:
        """Return the feedbacks that a plugin, which is `running` or not, waits for; empty: there is none."""
        return ", ".join(
            watch.doubt or watch.lacks
            for watch in self._feedback_timeouts
            if watch.doubt or watch.missed(running) or (watch.feedback.required and not watch.feedback.received)
        )

    def action(self) -> str:
        """Return the gravest action of the feedbacks that have timed out; `keep` if there is none."""
        return max(
            (watch.action for watch in self._feedback_timeouts if watch.timed_out), key=SEVERITY.index, default="keep"
        )

    def rivalries(self, now: float) -> str:
        """Return feedbacks with several publishers at the time `now` [s], and their names; empty: there is none."""
        return ", ".join(filter(None, (watch.feedback.rivalry(now) for watch in self._feedback_timeouts)))

    def refusals(self, now: float) -> str:
        """Return feedbacks that refused messages lately, before the time `now` [s], and why; empty: there is none."""
        return ", ".join(filter(None, [watch.refusal(now) for watch in self._feedback_timeouts]))

    def kept(self) -> str:
        """Return feedbacks that have timed out, but keep their last message; empty: there is none."""
        return ", ".join(
            watch.feedback.lacks for watch in self._feedback_timeouts if watch.timed_out and watch.action == "keep"
        )

    def reports(self, now: float) -> Iterator[tuple[str, HealthReport]]:
        """Yield the name and the health of each feedback at the time `now` [s]."""
        for watch in self._feedback_timeouts:
            yield watch.feedback.name, watch.report(now)

    def figures(self, now: float) -> dict[str, float | str]:
        """Return figures for health reports."""
        return {key: value for watch in self._feedback_timeouts for key, value in watch.figures(now).items()}

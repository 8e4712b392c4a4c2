"""Feedbacks of a plugin, and what it does when one times out."""

import enum
import logging
import math
from collections.abc import Iterator, Sequence

from solfer.config import FeedbackRecord
from solfer.pipes import FeedbackPipe
from solfer.transport.endpoints import NEW, MessageStatus
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport

logger = logging.getLogger(__name__)

TIMEOUT_ACTIONS = {
    "keep": "the last message stays valid",
    "hold": "the plugin holds until it is back",
    "damp": "the springs of the robot fade out",
    "stop": "the plugin ends",
}
"""Actions of a plugin when a feedback times out, the gravest last, with their text for the log."""

SEVERITY = tuple(TIMEOUT_ACTIONS)


class FeedbackState(enum.Enum):
    """What a feedback is at present; `next_state` has the transitions.

    WAITING: no message has come in time since the start. LIVE: the newest one came in time. SILENT: none has come for
    too long. FROZEN: messages come, but no number of them changes, though joints are commanded to move. DISPUTED:
    messages come, but contradict others. REPLACED: another publisher counts since this cycle.
    """

    WAITING = enum.auto()
    LIVE = enum.auto()
    SILENT = enum.auto()
    FROZEN = enum.auto()
    DISPUTED = enum.auto()
    REPLACED = enum.auto()


# module globals: the lookup in the control cycle is several times as fast as on the class
WAITING, LIVE, SILENT, FROZEN, DISPUTED, REPLACED = FeedbackState

TIMED_OUT = (SILENT, FROZEN, DISPUTED)


def next_state(state: FeedbackState, observed: FeedbackState | None) -> FeedbackState:
    """Return the state after a cycle.

    | observed in the cycle                                    | from REPLACED | from any other   |
    |----------------------------------------------------------|---------------|------------------|
    | nothing new, and not for too long                        | WAITING       | stays            |
    | a message in time                                        | LIVE          | LIVE             |
    | `strikes` cycles in a row: silence, numbers that stay,   | SILENT,       | SILENT, FROZEN,  |
    | or a contradiction                                       | FROZEN, ...   | DISPUTED         |
    | another publisher                                        | REPLACED      | REPLACED         |

    Args:
        state: The state before.
        observed: The state that the newest message alone would be in; None: there was nothing new.
    """
    if observed is not None:
        return observed
    return WAITING if state is REPLACED else state


REFUSAL_TIMEOUT = 0.3
"""Time after which a feedback is wrong whose messages all contradict others [s]."""


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
        state: What the feedback is at present.
        timeout: See above.
        timeouts: How often it timed out.
        count: Strikes in a row.
        fresh: Age up to which a message is neither late nor refused [s].
        handovers: Those of the feedback that it knows of.
        unsettled: Why no plugin may start with the received messages; empty: it may, or this was not checked yet.
    """

    def __init__(self, feedback: FeedbackPipe, timeout: float, strikes: int, action: str, where: str = ""):
        self.feedback = feedback
        self.where = where
        self.state = WAITING
        self.timeout = timeout
        self.timeouts = 0
        self.unsettled = ""
        self._action = action
        self._strikes = strikes
        self.count = 0
        self.fresh = min(timeout, REFUSAL_TIMEOUT)
        self._change = NewestChange()
        self.handovers = feedback.handovers
        feedback.set_timeout(timeout, strikes)

    @classmethod
    def from_record(cls, feedback: FeedbackPipe, record: FeedbackRecord, rate: float) -> "FeedbackTimeout":
        """Make the timeout that a record configures, in a plugin of a `rate` [Hz]."""
        # default of the age of the newest message above which a cycle is a strike [s]. A simulator on a shared
        # machine stalls for 20 ms now and then
        shortest = 0.2
        periods = 5  # the same in periods of the plugin; the longer one counts
        return cls(
            feedback,
            record.timeout or max(shortest, periods / rate),
            record.strikes,
            action=record.timeout_action,
            where=record.where("source"),
        )

    @property
    def timed_out(self) -> bool:
        """Whether no message that counts has come for too long."""
        return self.state in TIMED_OUT

    @property
    def action(self) -> str:
        """What the plugin does at a timeout: one of TIMEOUT_ACTIONS."""
        return "hold" if self.state is DISPUTED and self._action == "keep" else self._action

    def judge(self, status: MessageStatus, now: float, distance: float) -> bool:
        """Judge what was read at the time `now` [s]; return whether nothing is missing or late.

        If not, `serves` reports what that means.

        Args:
            status: What `feedback.run` has returned.
            now: The time [s].
            distance: How far joints have been commanded to move so far [rad, m].
        """
        feedback = self.feedback
        age = now - feedback.arrival
        change = self._change
        if feedback.changed != change.arrival:
            change.arrival = feedback.changed
            change.stamp = feedback.stamp
            change.distance = distance
        observed = None
        if feedback.handovers != self.handovers:  # another publisher measures another start
            self.handovers = feedback.handovers
            self.restart()
            observed = REPLACED
        elif age > REFUSAL_TIMEOUT and feedback.warnings.contradicts:  # each message is refused: it is wrong, not late
            # what it measured last is not kept, whatever its `on_timeout` says
            observed = DISPUTED
        elif age > self.timeout:
            observed = SILENT
        elif (
            change.arrival < math.inf
            and feedback.stamp - change.stamp > 0.15  # [s] while a simulation pauses, the stamps stay, too
            and distance - change.distance > 5e-3  # [rad, m] several steps of an encoder
            and feedback.measures
        ):
            observed = FROZEN
        elif status is NEW:
            observed = LIVE
            self.count = 0
        if observed in TIMED_OUT:
            self.count += 1
            if self.count < self._strikes:
                observed = None
        state = self.state
        if observed is not state and (observed is not None or state is REPLACED):
            self.state = next_state(state, observed)
            self._log_change(state, now)
        if self.state is LIVE:
            return feedback.received or not feedback.required
        return self.state is WAITING and not feedback.required

    def missed(self, running: bool) -> bool:
        """Whether a timeout keeps a plugin that is `running` or not from its work.

        With `keep` a running plugin goes on with the last message, but no plugin starts with it.
        """
        return self.timed_out and (self.action != "keep" or (self.feedback.required and not running))

    def serves(self, running: bool) -> bool:
        """Return whether a plugin that is `running` or not can work with what was read."""
        if self.state is REPLACED or self.missed(running):
            return False
        feedback = self.feedback
        # nothing starts with an old message
        return not feedback.required or (feedback.received and (self.state is LIVE or self.action == "keep"))

    def restart(self) -> None:
        """Begin again: discard all that was received so far."""
        self.feedback.restart()
        self.state = WAITING
        self.count = 0

    @property
    def lacks(self) -> str:
        """Description of what a plugin waits for: values, and the publisher that is silent, if it is known."""
        feedback = self.feedback
        is_known = self.timed_out and feedback.silent
        return f"{feedback.lacks}, where {feedback.silent} is silent" if is_known else feedback.lacks

    def refusal(self, now: float) -> str:
        """Return why messages were refused, or odd, lately, before the time `now` [s]; empty: none was."""
        place = self.feedback.place
        warnings = self.feedback.warnings
        recent = 0.5  # [s]
        if warnings.refusal and now - warnings.refused_at < recent:
            return f"{place} refuses messages of {warnings.refusal}"
        return f"{place}: {warnings.remark}" if now - warnings.remarked_at < recent else ""

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
        warning = self.refusal(now) or self.unsettled
        if self.timed_out:
            level = Health.WARNING if self.action == "keep" else Health.ERROR
            summary = f"nothing new on {feedback.reader.topic}: {TIMEOUT_ACTIONS[self.action]}"
        elif feedback.required and not feedback.received:
            level = Health.WARNING
            summary = warning or f"nothing received on {feedback.reader.topic} yet"
        else:
            level = Health.WARNING if warning else Health.GOOD
            summary = warning or ("received" if feedback.received else "not received yet")
        return HealthReport(level, summary, self.figures(now))

    def _log_change(self, before: FeedbackState, now: float) -> None:
        """Log that the feedback has timed out, or is back."""
        feedback = self.feedback
        if before in TIMED_OUT:
            if self.state is LIVE:
                logger.info("feedback '%s' (%s) is back", feedback.name, feedback.reader.topic)
            return
        if self.state not in TIMED_OUT:
            return
        self.timeouts += 1
        frozen = self.state is FROZEN
        silent = f" of {feedback.silent}" if feedback.silent else ""
        logger.warning(
            "feedback '%s' (%s): %s for %.3f s: %s",
            feedback.name,
            feedback.reader.topic,
            "no number has changed, though joints were commanded to move," if frozen else f"nothing new{silent}",
            now - (feedback.changed if frozen else feedback.arrival),
            TIMEOUT_ACTIONS[self.action],
        )


class FeedbackTimeouts:
    """All feedbacks of a plugin, in the order of the configuration.

    Args:
        timeouts: One for each feedback.

    Attributes:
        timeouts: See above.
        feedbacks: The feedbacks.
        complete: Whether nothing was missing or late when they were read last.
    """

    def __init__(self, timeouts: Sequence[FeedbackTimeout]):
        self.timeouts = tuple(timeouts)
        self.feedbacks = tuple(each.feedback for each in timeouts)
        self.complete = False

    def read(self, now: float, distance: float = 0.0) -> bool:
        """Read the newest messages at the time `now` [s], each pipe into its State or the component's input.

        Returns `complete`.

        Args:
            now: The time [s].
            distance: How far joints have been commanded to move so far [rad, m].
        """
        complete = True
        for each in self.timeouts:
            feedback = each.feedback
            status = feedback.run()
            arrival = feedback.arrival
            if (
                # nothing has come of what the plugin need not have
                arrival == math.inf
                and each.state is WAITING
                and not feedback.required
                and feedback.handovers == each.handovers
            ):
                continue
            if (
                # one that goes on, whose newest message has changed something, which is nearly every one
                each.state is LIVE
                and now - arrival <= each.fresh
                and (feedback.changed == arrival or feedback.changed == math.inf)
                and feedback.received
                and not each.count
                and feedback.handovers == each.handovers
            ):
                continue
            if not each.judge(status, now, distance):
                complete = False
        self.complete = complete
        return complete

    def serve(self, running: bool) -> bool:
        """Return whether a plugin that is `running` or not can work with what was read, and has been received."""
        return self.complete or all(each.serves(running) for each in self.timeouts)

    def begins(self, now: float) -> bool:
        """Return whether a plugin may start at the time `now` [s] with what was read.

        Raises:
            OutOfLimits: It would start with a joint outside of its limits.
        """
        ready = self.serve(False)
        for each in self.timeouts:
            each.unsettled = each.feedback.unsettled(now) if ready else ""
        if not ready or any(each.unsettled for each in self.timeouts):
            return False
        for each in self.timeouts:
            each.feedback.check_start()
        return True

    @property
    def shortest_timeout(self) -> float:
        """Shortest timeout of a feedback [s]."""
        return min((each.timeout for each in self.timeouts), default=math.inf)

    def restart(self) -> None:
        """Begin again: discard all that was received so far."""
        for each in self.timeouts:
            each.restart()

    def lacks(self, running: bool) -> str:
        """Return the feedbacks that a plugin, which is `running` or not, waits for; empty: there is none."""
        return ", ".join(
            each.unsettled or each.lacks
            for each in self.timeouts
            if each.unsettled or each.missed(running) or (each.feedback.required and not each.feedback.received)
        )

    def action(self) -> str:
        """Return the gravest action of the feedbacks that have timed out; `keep` if there is none."""
        return max((each.action for each in self.timeouts if each.timed_out), key=SEVERITY.index, default="keep")

    def conflicts(self, now: float) -> str:
        """Return feedbacks with several publishers at the time `now` [s], and their names; empty: there is none."""
        return ", ".join(filter(None, (each.feedback.conflict(now) for each in self.timeouts)))

    def refusals(self, now: float) -> str:
        """Return feedbacks that refused messages lately, before the time `now` [s], and why; empty: there is none."""
        return ", ".join(filter(None, [each.refusal(now) for each in self.timeouts]))

    def kept(self) -> str:
        """Return feedbacks that have timed out, but keep their last message; empty: there is none."""
        return ", ".join(each.feedback.lacks for each in self.timeouts if each.timed_out and each.action == "keep")

    def reports(self, now: float) -> Iterator[tuple[str, HealthReport]]:
        """Yield the name and the health of each feedback at the time `now` [s]."""
        for each in self.timeouts:
            yield each.feedback.name, each.report(now)

    def figures(self, now: float) -> dict[str, float | str]:
        """Return figures for health reports."""
        return {key: value for each in self.timeouts for key, value in each.figures(now).items()}

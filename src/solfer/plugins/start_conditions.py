"""Judges once a cycle whether a plugin may work: it receives its feedbacks, has its joints, its loop goes on.

A verdict is only a word: what it requests is done by the plugin.
"""

import enum
import logging
import math
from collections.abc import Iterator

from solfer.errors import MiddlewareError, ReceiveTimeout
from solfer.plugins.feedback_timeout import FeedbackTimeouts
from solfer.plugins.joint_claim import JointClaim
from solfer.transport import Middleware
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport

FIRST_MESSAGES_PATIENCE = 60.0
"""Longest wait for the first messages of all required feedbacks [s]."""

RESTART_SETTLING_TIME = 0.1
"""Time after a simulation began again until received messages are certain to be new [s]."""

STALL = 0.2
"""Default of the lateness of a plugin's own loop at which it starts again [s]. After less a component goes on, by the
time that has passed; meanwhile the lower level carries out its last commands, for its lease on the joints is longer."""

SETTLING_PERIODS = 5
"""The same in periods of the plugin; the longer one counts."""


class CycleVerdict(enum.Enum):
    """What a plugin has to do in this cycle.

    WORK: run the component. HOLD: bring the joints to rest, give them back, then wait. WAIT: do nothing. FORGET:
    discard all that was received, and wait; send no last command either, since the robot is in another state than a
    moment ago.
    """

    WORK = enum.auto()
    HOLD = enum.auto()
    WAIT = enum.auto()
    FORGET = enum.auto()


# module globals: the lookup in the control cycle is several times as fast as on the class
WORK, HOLD, WAIT, FORGET = CycleVerdict


class StartConditions:
    """Judges once a cycle what a plugin may do, by what was read before; changes nothing but its own notes.

    Args:
        plugin: Name of the plugin, for messages.
        watches: Its feedbacks.
        middleware: The clock of the pipes.
        claim: Its claim on the joints that it commands; None: it commands none.
        period: Time from one of its cycles to the next [s].
        stall: Lateness of its loop at which it begins again [s]; None: STALL or PERIODS, whichever is longer. It is
            capped at the shortest timeout of a feedback, after which other plugins would hold, too.

    Attributes:
        lacks: What the plugin waits for.
        level: Severity of that, a level of `logging`.
    """

    def __init__(
        self,
        plugin: str,
        watches: FeedbackTimeouts,
        middleware: Middleware,
        claim: JointClaim | None,
        period: float,
        *,
        stall: float | None = None,
    ):
        self._plugin = plugin
        self._feedback_timeouts = watches
        self._claim = claim
        self._longest = period + min(stall or max(STALL, SETTLING_PERIODS * period), watches.patience)
        self._newest = math.inf
        self._middleware = middleware
        self._now = middleware.now
        self._rewinds = middleware.rewinds
        self._latest: float | None = None
        self._earliest = -math.inf
        self._past = ""
        self.lacks = self._missing()
        self.level = logging.DEBUG

    def stall(self, now: float) -> float:
        """Measure how long the loop stood still before this cycle, which begins `now` [s]; 0: it did not [s]."""
        gap = now - self._newest
        self._newest = now
        if gap <= self._longest:
            return 0.0
        self._past = f"after its own loop stood still for {gap:.3f} s"
        return gap

    def judge(self, now: float, running: bool) -> CycleVerdict:
        """Judge by the messages that were read `now` [s] what a plugin that is `running` or not does in this cycle.

        Raises:
            ReceiveTimeout: A required feedback did not arrive in time.
            OutOfLimits: The plugin would start with a joint outside of its limits.
            MiddlewareError: A feedback with `on_timeout: stop` timed out.
        """
        timeouts = self._feedback_timeouts
        # after the messages: a simulator publishes that the time went back before it publishes the new state
        if self._middleware.rewinds != self._rewinds:
            self._rewinds = self._middleware.rewinds
            self._past = "after the simulated time went back"
            return FORGET
        if now < self._earliest:
            timeouts.restart()  # what is compared with an old measurement would be refused
            return WAIT
        received = (timeouts.complete or timeouts.serve(True)) if running else timeouts.begins(now)
        return WORK if received else self._miss(now, running)

    def judge_claim(self, claim: JointClaim, running: bool) -> CycleVerdict:
        """Judge what a plugin does whose joints are not its own at present; see `judge`."""
        if claim.restarted:
            self._past = f"after {claim.reason}"
            return FORGET
        self.lacks = f"for its joints: {claim.reason or 'not answered yet'}"
        self.level = logging.ERROR if claim.reason else logging.DEBUG
        return HOLD if running else WAIT

    def forgotten(self, now: float) -> None:
        """Note that all was discarded that was received before `now` [s]: what comes soon may be old, too."""
        self._earliest = now + RESTART_SETTLING_TIME
        self.lacks = f"{self._missing()}, {self._past}"
        self.level = logging.WARNING

    def started(self) -> None:
        """Mark the plugin as running: later waits are unlimited, and the duration of its start is not a stall."""
        self._latest, self._newest = math.inf, self._now()

    def restart(self) -> None:
        """Reset to the state before the first cycle."""
        self._latest = None
        self._newest = math.inf
        self.lacks = self._missing()
        self.level = logging.DEBUG

    def health(self, running: bool) -> tuple[Health, str]:
        """Return the health since the last call, and one sentence; empty if good."""
        if not running:
            refused = self._claim is not None and self._claim.reason
            return Health.ERROR if refused else Health.WARNING, f"holds and waits {self.lacks}"
        complaint = self._claim.complaint() if self._claim is not None else ""
        kept = self._feedback_timeouts.kept()
        if kept and not complaint:
            complaint = f"goes on with the last message of feedback {kept}"
        now = self._now()
        timeouts = self._feedback_timeouts
        doubts = timeouts.rivalries(now) or timeouts.refusals(now)
        if doubts and not complaint:
            complaint = f"feedback {doubts}"
        return (Health.WARNING, complaint) if complaint else (Health.GOOD, "")

    def figures(self) -> dict[str, float | str]:
        """Return figures for health reports."""
        refused = {} if self._claim is None else {"refused by the lower level": self._claim.refused}
        return {**self._feedback_timeouts.figures(self._now()), **refused}

    def reports(self) -> Iterator[tuple[str, HealthReport]]:
        """Yield the name and the health of each feedback."""
        return self._feedback_timeouts.reports(self._now())

    def _miss(self, now: float, running: bool) -> CycleVerdict:
        """Handle a missing feedback."""
        rivalries = self._feedback_timeouts.rivalries(now)
        self.lacks = self._missing(running)
        self.level = logging.WARNING if running or rivalries else logging.INFO
        if running:
            if self._feedback_timeouts.action() == "stop":
                raise MiddlewareError(
                    f"nothing new {self.lacks}, and its 'on_timeout' is 'stop'",
                    expected="a publisher that goes on, or `on_timeout: hold`",
                )
            return HOLD
        if self._latest is None:
            self._latest = now + FIRST_MESSAGES_PATIENCE
        elif now > self._latest and not rivalries:
            raise ReceiveTimeout(
                f"plugin '{self._plugin}' has waited {FIRST_MESSAGES_PATIENCE:g} s {self.lacks}",
                expected="a publisher; `initialize: false`, or `open_loop: true` of joints that are not measured",
            )
        return WAIT

    def _missing(self, running: bool = False) -> str:
        lacks = self._feedback_timeouts.lacks(running)
        return f"for feedback {lacks}" if lacks else "for its first cycle"

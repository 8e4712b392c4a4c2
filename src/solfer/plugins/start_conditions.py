"""Conditions for a plugin to work: it receives its feedbacks, has its joints, and its loop did not stand still."""

import enum
import logging
import math

from solfer.errors import MiddlewareError, ReceiveTimeout
from solfer.plugins.feedback_timeout import FeedbackTimeouts
from solfer.plugins.joint_claim import JointClaim
from solfer.transport import Middleware

FIRST = 60.0
"""Longest wait for the first messages of all required feedbacks [s]."""

SETTLE = 0.1
"""Time after a simulation began anew until received messages are certain to be new [s]."""

STALL = 0.06
"""Default of the lateness of a plugin's own loop at which it begins anew [s]."""

PERIODS = 5
"""The same in periods of the plugin; the longer one counts."""


class CycleVerdict(enum.Enum):
    """Action of a plugin in this cycle.

    WORK: run the component. HOLD: bring the joints to rest, then `let_go`, then wait. WAIT: do nothing. FORGET: do
    nothing and send no last command either, since the robot is in another state than a moment ago.
    """

    WORK = enum.auto()
    HOLD = enum.auto()
    WAIT = enum.auto()
    FORGET = enum.auto()


class StartConditions:
    """Decides once a cycle whether a plugin can work.

    Args:
        plugin: Name of the plugin, for messages.
        watches: Its feedbacks.
        middleware: The clock of the pipes.
        claim: Its claim on the joints that it commands; None: it commands none.
        period: Time from one of its cycles to the next [s].
        stall: Lateness of its loop at which it begins anew [s]; None: STALL or PERIODS, whichever is longer. It is
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
        stall: float | None = None,
    ):
        self._plugin, self._feedback_timeouts, self._claim = plugin, watches, claim
        self._longest = period + min(stall or max(STALL, PERIODS * period), watches.patience)
        self._newest = math.inf
        self._middleware, self._now, self._rewinds = middleware, middleware.now, middleware.rewinds
        self._latest: float | None = None
        self._earliest = -math.inf
        self.lacks, self.level = self._missing(), logging.DEBUG

    def asleep(self) -> float:
        """Measure how long the loop stood still before this cycle [s]; 0 if it did not. To be called in each cycle."""
        now = self._now()
        gap, self._newest = now - self._newest, now
        return gap if gap > self._longest else 0.0

    def awake(self, gap: float) -> None:
        """Forget messages, received or still waiting, from before the loop stood still for `gap` [s]."""
        self._forget(self._now(), f"after its own loop stood still for {gap:.3f} s")

    def look(self, running: bool) -> CycleVerdict:
        """Read the newest messages, and decide what a plugin that is `running` or not does in this cycle.

        Raises:
            ClaimRefused: Another plugin commands a joint of this one.
            ReceiveTimeout: A required feedback did not arrive in time.
            OutOfLimits: The plugin would start with a joint outside of its limits.
            MiddlewareError: A feedback with `on_timeout: stop` timed out.
        """
        now = self._now()
        received = self._feedback_timeouts.run(now, running)
        # after the messages: a simulator publishes that the time went back before it publishes the new state
        if self._middleware.rewinds != self._rewinds:
            self._rewinds = self._middleware.rewinds
            return self._forget(now, "after the simulated time went back")
        if not received:
            return self._miss(now, running)
        if now < self._earliest:
            return CycleVerdict.WAIT
        return CycleVerdict.WORK if self._claim is None else self._own(now, running)

    def let_go(self) -> None:
        """Release or lapse the claim, or damp, after the joints were brought to rest."""
        if self._claim is None:
            return
        if self._feedback_timeouts.action() == "damp":
            self._claim.damp()
        if self._claim.reason:
            self._claim.release()
        else:
            self._claim.lapse()

    def started(self) -> None:
        """Mark the plugin as running: later waits are unlimited, and the duration of its start is not a stall."""
        self._latest, self._newest = math.inf, self._now()

    def restart(self) -> None:
        """Reset to the state before the first cycle."""
        self._feedback_timeouts.restart()
        self._latest, self._newest = None, math.inf
        self.lacks, self.level = self._missing(), logging.DEBUG

    def health(self, running: bool) -> tuple[int, str]:
        """Return the health since the last call: level 0 good, 1 warning, 2 error, and one sentence; empty if good."""
        if not running:
            return 2 if self._claim is not None and self._claim.reason else 1, f"holds and waits {self.lacks}"
        complaint, kept = self._claim.complaint() if self._claim is not None else "", self._feedback_timeouts.kept()
        if kept and not complaint:
            complaint = f"goes on with the last message of feedback {kept}"
        rivalries = self._feedback_timeouts.rivalries(self._now())
        if rivalries and not complaint:
            complaint = f"feedback {rivalries}"
        return (1, complaint) if complaint else (0, "")

    def figures(self) -> dict[str, float | str]:
        """Return figures for health reports."""
        refused = {} if self._claim is None else {"refused by the lower level": self._claim.refused}
        return {**self._feedback_timeouts.figures(self._now()), **refused}

    def _miss(self, now: float, running: bool) -> CycleVerdict:
        """Handle a missing feedback."""
        rivalries = self._feedback_timeouts.rivalries(now)
        self.lacks, self.level = self._missing(), logging.WARNING if running or rivalries else logging.INFO
        if running:
            if self._feedback_timeouts.action() == "stop":
                raise MiddlewareError(
                    f"nothing new {self.lacks}, and its 'on_timeout' is 'stop'",
                    expected="a publisher that goes on, or `on_timeout: hold`",
                )
            return CycleVerdict.HOLD
        if self._latest is None:
            self._latest = now + FIRST
        elif now > self._latest and not rivalries:
            raise ReceiveTimeout(
                f"plugin '{self._plugin}' has waited {FIRST:g} s {self.lacks}",
                expected="a publisher, or `initialize: false`",
            )
        return CycleVerdict.WAIT

    def _own(self, now: float, running: bool) -> CycleVerdict:
        """Check the claim on the joints."""
        claim = self._claim
        if not (claim.lost() if running else not claim.granted()):
            return CycleVerdict.WORK
        if running and claim.began_anew:
            return self._forget(now, f"after {claim.reason}")
        self.lacks = f"for its joints: {claim.reason or 'not answered yet'}"
        self.level = logging.ERROR if claim.reason else logging.DEBUG
        return CycleVerdict.HOLD if running else CycleVerdict.WAIT

    def _forget(self, now: float, reason: str) -> CycleVerdict:
        """Discard all that was received so far."""
        self._feedback_timeouts.restart()
        if self._claim is not None:
            self._claim.lapse()
        self._earliest = now + SETTLE
        self.lacks, self.level = f"{self._missing()}, {reason}", logging.WARNING
        return CycleVerdict.FORGET

    def _missing(self) -> str:
        lacks = self._feedback_timeouts.lacks()
        return f"for feedback {lacks}" if lacks else "for its first cycle"

"""Whether a plugin can do its work: whom it needs speaks, its joints are its own, and the robot is where it was."""

import enum
import logging
import math

from solfer.errors import MiddlewareError, NotHeard
from solfer.pipes import Middleware
from solfer.plugins.claim import Claim
from solfer.plugins.watch import Watches

FIRST = 60.0
"""Longest wait for the first messages of all required feedbacks [s]."""

SETTLE = 0.1
"""Time after a simulation began anew until what is heard is about its new beginning [s]."""


class Verdict(enum.Enum):
    """What a plugin has to do in this cycle.

    WORK: what it is for. HOLD: bring the joints to rest, then `let_go`, then wait. WAIT: nothing. FORGET: nothing, also
    no last command, since the robot is in another state than a moment ago.
    """

    WORK = enum.auto()
    HOLD = enum.auto()
    WAIT = enum.auto()
    FORGET = enum.auto()


class Readiness:
    """Looks once a cycle.

    Args:
        plugin: Name of the plugin, for messages.
        watches: Whom it hears.
        middleware: The clock of the pipes.
        claim: Its claim on the joints that it commands; None: it commands none.

    Attributes:
        lacks: What the plugin waits for.
        level: How grave that is, a level of `logging`.
    """

    def __init__(self, plugin: str, watches: Watches, middleware: Middleware, claim: Claim | None):
        self._plugin, self._watches, self._claim = plugin, watches, claim
        self._middleware, self._now, self._rewinds = middleware, middleware.now, middleware.rewinds
        self._latest: float | None = None
        self._earliest = -math.inf
        self.lacks, self.level = self._missing(), logging.DEBUG

    def look(self, running: bool) -> Verdict:
        """Take over the newest messages; what a plugin that is `running` or not can do.

        Raises:
            ClaimRefused: Somebody else commands a joint of this plugin.
            NotHeard: A required feedback did not come in time.
            MiddlewareError: A feedback is silent that the plugin shall not outlive.
        """
        now = self._now()
        heard = self._watches.run(now)
        # after the messages: who simulates tells that the time went back before it tells what is there now
        if self._middleware.rewinds != self._rewinds:
            self._rewinds = self._middleware.rewinds
            return self._forget(now, "after the simulated time went back")
        if not heard:
            return self._miss(now, running)
        if now < self._earliest:
            return Verdict.WAIT
        return Verdict.WORK if self._claim is None else self._own(now, running)

    def let_go(self) -> None:
        """The joints are at rest: what a plugin that cannot go on does with its claim."""
        if self._claim is None:
            return
        if self._watches.action() == "damp":
            self._claim.damp()
        if self._claim.reason:
            self._claim.release()
        else:
            self._claim.lapse()

    def started(self) -> None:
        """The plugin runs: from now on it may wait as long as it takes."""
        self._latest = math.inf

    def restart(self) -> None:
        """Begin as at first."""
        self._watches.restart()
        self._latest = None
        self.lacks, self.level = self._missing(), logging.DEBUG

    def health(self, running: bool) -> tuple[int, str]:
        """Health since the last call: level 0 good, 1 warning, 2 error, and one sentence; empty if all is well."""
        if not running:
            return 2 if self._claim is not None and self._claim.reason else 1, f"holds and waits {self.lacks}"
        complaint, kept = self._claim.complaint() if self._claim is not None else "", self._watches.kept()
        if kept and not complaint:
            complaint = f"goes on with what was said last by feedback {kept}"
        return (1, complaint) if complaint else (0, "")

    def figures(self) -> dict[str, float | str]:
        """Figures for health reports."""
        refused = {} if self._claim is None else {"refused by the lower level": self._claim.refused}
        return {**self._watches.figures(self._now()), **refused}

    def _miss(self, now: float, running: bool) -> Verdict:
        """A feedback is missing."""
        self.lacks, self.level = self._missing(), logging.WARNING if running else logging.INFO
        if running:
            if self._watches.action() == "stop":
                raise MiddlewareError(f"nothing new {self.lacks}, and its 'on_timeout' is 'stop'")
            return Verdict.HOLD
        if self._latest is None:
            self._latest = now + FIRST
        elif now > self._latest:
            raise NotHeard(f"plugin '{self._plugin}' has waited {FIRST:g} s {self.lacks}",
                           expected="somebody who tells it, or `initialize: false`")
        return Verdict.WAIT

    def _own(self, now: float, running: bool) -> Verdict:
        """Whether the joints are ours."""
        claim = self._claim
        if not (claim.lost() if running else not claim.granted()):
            return Verdict.WORK
        if running and claim.began_anew:
            return self._forget(now, f"after {claim.reason}")
        self.lacks = f"for its joints: {claim.reason or 'not answered yet'}"
        self.level = logging.ERROR if claim.reason else logging.DEBUG
        return Verdict.HOLD if running else Verdict.WAIT

    def _forget(self, now: float, reason: str) -> Verdict:
        """What was heard so far does not count."""
        self._watches.restart()
        if self._claim is not None:
            self._claim.lapse()
        self._earliest = now + SETTLE
        self.lacks, self.level = f"{self._missing()}, {reason}", logging.WARNING
        return Verdict.FORGET

    def _missing(self) -> str:
        lacks = self._watches.lacks()
        return f"for feedback {lacks}" if lacks else "for its first cycle"

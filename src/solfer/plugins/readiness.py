"""Whether a plugin has what it needs to work: its feedbacks, its joints, and a loop that goes on."""

import enum
import logging
import math
from collections.abc import Callable, Iterator, Sequence

from solfer.errors import MiddlewareError, ReceiveTimeout
from solfer.plugins.feedback_timeout import FeedbackTimeout, FeedbackTimeouts
from solfer.plugins.joint_claim import JointClaim
from solfer.transport import Middleware
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport

logger = logging.getLogger(__name__)


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
WORK = CycleVerdict.WORK
HOLD = CycleVerdict.HOLD
WAIT = CycleVerdict.WAIT
FORGET = CycleVerdict.FORGET


class Readiness:
    """Decides once a cycle whether a plugin may work with its feedbacks and joints, and gives the joints back.

    Args:
        plugin: Name of the plugin, for messages.
        timeouts: Its feedbacks, each with its timeout.
        claim: Its claim on the joints that it commands; None: it commands none.
        middleware: The clock of the pipes.
        period: Time of a control cycle [s].
        stall: Lateness of its loop at which it begins again [s]; None: 0.2 s or five periods, whichever is longer. It
            is capped at the shortest timeout of a feedback, after which other plugins would hold, too.

    Attributes:
        feedbacks: Its feedbacks with their timeouts.
        taken: Called in each cycle while others have the joints.
        lacks: What the plugin waits for.
        claim: See above.
        newest: When its newest cycle began; infinity: it is not known [s]. Its plugin keeps it.
        longest: Time between two cycles from which on its loop stood still [s].
        earliest: When it may work again [s].
        rewinds: The middleware's `rewinds` that it knows of.
        rewind_words: That of the middleware.
    """

    def __init__(
        self,
        plugin: str,
        timeouts: Sequence[FeedbackTimeout],
        claim: JointClaim | None,
        middleware: Middleware,
        period: float,
        *,
        stall: float | None = None,
    ):
        self.feedbacks = FeedbackTimeouts(timeouts)
        self.taken: Callable[[], None] = lambda: None
        self._plugin = plugin
        self.claim = claim
        self._middleware = middleware
        self.rewinds = middleware.rewinds
        self.rewind_words = middleware.rewind_words()
        # after less a component goes on, by the time that has passed; meanwhile the lower level carries out its last
        # commands, for its lease on the joints is longer
        self.longest = period + min(stall or max(0.2, 5 * period), self.feedbacks.shortest_timeout)
        self._past = ""
        self._logged = ""
        self.earliest = -math.inf
        self._latest: float | None = None
        self.newest = math.inf
        self.lacks = self._missing()
        self._level = logging.DEBUG

    @property
    def released(self) -> bool:
        """Whether the joints were released, and the lower level has confirmed it."""
        return self.claim is None or self.claim.released

    def stand_still(self, gap: float) -> None:
        """Note that the loop stood still for a time [s], before a plugin begins again."""
        self._past = f"after its own loop stood still for {gap:.3f} s"

    def decide(self, now: float, running: bool) -> CycleVerdict:
        """Decide by the messages that were read `now` [s] what a plugin that is `running` or not does in this cycle.

        Its plugin need not ask while it runs, all feedbacks are there, `earliest` is over, no time has gone back, and
        the claim, if there is one, has no `reason`, is not taken and has no news: it works. Claims the joints when all
        feedbacks are there.

        Raises:
            ReceiveTimeout: A required feedback did not arrive in time.
            OutOfLimits: The plugin would start with a joint outside of its limits.
            MiddlewareError: A feedback with `on_timeout: stop` timed out.
            ClaimRefused: Another plugin commands a joint of this one.
        """
        verdict = self._decide_by_feedbacks(now, running)
        claim = self.claim
        if claim is None:
            return verdict
        if not running and claim.restarts():
            return self._wait_for_joints(claim, running)
        if verdict is not WORK:
            return verdict
        if running:
            ours = not (claim.lost() if claim.refusals.waits else claim.reason)
        else:
            ours = claim.granted()
        if claim.is_taken:
            self.taken()
        return verdict if ours else self._wait_for_joints(claim, running)

    def start(self) -> None:
        """Mark the plugin as running: later waits are unlimited, and the duration of its start is not a stall."""
        self._logged = ""
        self._latest = math.inf
        self.newest = self._middleware.now()

    def give_back(self) -> None:
        """Release or lapse the claim, or damp, after the joints were brought to rest."""
        claim = self.claim
        if claim is None:
            return
        if self.feedbacks.action() == "damp":
            claim.damp()
        if claim.reason:
            claim.release()
        else:
            claim.lapse()

    def release(self) -> None:
        """Release the joints for good."""
        if self.claim is not None:
            self.claim.release()

    def forget(self, now: float) -> None:
        """Discard all that was received before `now` [s], and the claim: what comes soon may be old, too."""
        self.feedbacks.restart()
        if self.claim is not None:
            self.claim.lapse()
        self.earliest = now + 0.1  # by then received messages are certain to be new [s]
        self.lacks = f"{self._missing()}, {self._past}"
        self._level = logging.WARNING

    def restart(self) -> None:
        """Begin again, as before the first cycle."""
        self.feedbacks.restart()
        self._latest = None
        self.newest = math.inf
        self.lacks = self._missing()
        self._level = logging.DEBUG

    def log_wait(self) -> bool:
        """Log what the plugin waits for, if that has changed; return whether it has."""
        if self.lacks == self._logged:
            return False
        self._logged = self.lacks
        logger.log(self._level, "%s holds and waits %s", self._plugin, self.lacks)
        return True

    def health(self, running: bool) -> tuple[Health, str]:
        """Return the health since the last call, and one sentence; empty if good."""
        claim = self.claim
        if not running:
            refused = claim is not None and claim.reason
            return Health.ERROR if refused else Health.WARNING, f"holds and waits {self.lacks}"
        warning = claim.warning() if claim is not None else ""
        kept = self.feedbacks.kept()
        if kept and not warning:
            warning = f"goes on with the last message of feedback {kept}"
        now = self._middleware.now()
        suspect = self.feedbacks.conflicts(now) or self.feedbacks.refusals(now)
        if suspect and not warning:
            warning = f"feedback {suspect}"
        return (Health.WARNING, warning) if warning else (Health.GOOD, "")

    def figures(self) -> dict[str, float | str]:
        """Return figures for health reports."""
        refused = {} if self.claim is None else {"refused by the lower level": self.claim.refused}
        return {**self.feedbacks.figures(self._middleware.now()), **refused}

    def reports(self) -> Iterator[tuple[str, HealthReport]]:
        """Yield the name and the health of each feedback."""
        return self.feedbacks.reports(self._middleware.now())

    def _decide_by_feedbacks(self, now: float, running: bool) -> CycleVerdict:
        # after the messages: a simulator publishes that the time went back before it publishes the new state
        if self._middleware.rewinds != self.rewinds:
            self.rewinds = self._middleware.rewinds
            self._past = "after the simulated time went back"
            return FORGET
        feedbacks = self.feedbacks
        if now < self.earliest:
            feedbacks.restart()  # what is compared with an old measurement would be refused
            return WAIT
        ready = (feedbacks.complete or feedbacks.serve(True)) if running else feedbacks.begins(now)
        return WORK if ready else self._miss(now, running)

    def _wait_for_joints(self, claim: JointClaim, running: bool) -> CycleVerdict:
        """Decide what a plugin does whose joints are not its own at present."""
        if claim.restarted:
            self._past = f"after {claim.reason}"
            return FORGET
        self.lacks = f"for its joints: {claim.reason or 'not answered yet'}"
        self._level = logging.ERROR if claim.reason else logging.DEBUG
        return HOLD if running else WAIT

    def _miss(self, now: float, running: bool) -> CycleVerdict:
        """Decide what a plugin does that misses a feedback."""
        feedbacks = self.feedbacks
        conflicts = feedbacks.conflicts(now)
        self.lacks = self._missing(running)
        self._level = logging.WARNING if running or conflicts else logging.INFO
        if running:
            if feedbacks.action() == "stop":
                raise MiddlewareError(
                    f"nothing new {self.lacks}, and its 'on_timeout' is 'stop'",
                    expected="a publisher that goes on, or `on_timeout: hold`",
                )
            return HOLD
        patience = 60.0  # [s] for the first messages of all required feedbacks
        if self._latest is None:
            self._latest = now + patience
        elif now > self._latest and not conflicts:
            raise ReceiveTimeout(
                f"plugin '{self._plugin}' has waited {patience:g} s {self.lacks}",
                expected="a publisher; `initialize: false`, or `open_loop: true` of joints that are not measured",
            )
        return WAIT

    def _missing(self, running: bool = False) -> str:
        lacks = self.feedbacks.lacks(running)
        return f"for feedback {lacks}" if lacks else "for its first cycle"

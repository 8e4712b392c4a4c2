"""Whether a plugin has what it needs to work: its feedbacks, its joints, and a loop that goes on."""

import logging
from collections.abc import Callable, Iterator, Sequence

from solfer.plugins.feedback_timeout import FeedbackTimeout, FeedbackTimeouts
from solfer.plugins.joint_claim import JointClaim
from solfer.plugins.start_conditions import WORK, CycleVerdict, StartConditions
from solfer.transport import Middleware
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport

logger = logging.getLogger(__name__)


class Readiness:
    """Feedbacks and joints of a plugin: judges once a cycle whether it may work with them, and gives the joints back.

    Args:
        plugin: Name of the plugin, for messages.
        watches: Its feedbacks, each with its timeout.
        claim: Its claim on the joints that it commands; None: it commands none.
        middleware: The clock of the pipes.
        period: Time of a control cycle [s].
        stall: See `StartConditions`.

    Attributes:
        feedbacks: Its feedbacks with their timeouts.
        taken: Called in each cycle while others have the joints.
        stall: See `StartConditions.stall`.
    """

    def __init__(
        self,
        plugin: str,
        watches: Sequence[FeedbackTimeout],
        claim: JointClaim | None,
        middleware: Middleware,
        period: float,
        *,
        stall: float | None = None,
    ):
        self.feedbacks = FeedbackTimeouts(watches)
        self.taken: Callable[[], None] = lambda: None
        self._plugin = plugin
        self._claim = claim
        self._conditions = StartConditions(plugin, self.feedbacks, middleware, claim=claim, period=period, stall=stall)
        self.stall = self._conditions.stall
        self._logged = ""

    @property
    def lacks(self) -> str:
        """What the plugin waits for."""
        return self._conditions.lacks

    @property
    def released(self) -> bool:
        """Whether the joints were released, and the lower level has confirmed it."""
        return self._claim is None or self._claim.released

    def judge(self, now: float, running: bool) -> CycleVerdict:
        """Judge what to do in this cycle, whose messages were read `now` [s]; claim the joints when all is there."""
        verdict = self._conditions.judge(now, running)
        claim = self._claim
        if claim is not None and not running and claim.restarts():
            return self._conditions.judge_claim(claim, running)
        if verdict is not WORK or claim is None:
            return verdict
        ours = not claim.lost() if running else claim.granted()
        if claim.is_taken:
            self.taken()
        return verdict if ours else self._conditions.judge_claim(claim, running)

    def start(self) -> None:
        """Mark the plugin as running."""
        self._logged = ""
        self._conditions.started()

    def give_back(self) -> None:
        """Release or lapse the claim, or damp, after the joints were brought to rest."""
        claim = self._claim
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
        if self._claim is not None:
            self._claim.release()

    def forget(self, now: float) -> None:
        """Discard all that was received before `now` [s], and the claim."""
        self.feedbacks.restart()
        if self._claim is not None:
            self._claim.lapse()
        self._conditions.forgotten(now)

    def restart(self) -> None:
        """Begin again, as before the first cycle."""
        self.feedbacks.restart()
        self._conditions.restart()

    def log_wait(self) -> bool:
        """Log what the plugin waits for, if that has changed; return whether it has."""
        lacks = self._conditions.lacks
        if lacks == self._logged:
            return False
        self._logged = lacks
        logger.log(self._conditions.level, "%s holds and waits %s", self._plugin, lacks)
        return True

    def health(self, running: bool) -> tuple[Health, str]:
        """See `StartConditions.health`."""
        return self._conditions.health(running)

    def figures(self) -> dict[str, float | str]:
        """See `StartConditions.figures`."""
        return self._conditions.figures()

    def reports(self) -> Iterator[tuple[str, HealthReport]]:
        """See `StartConditions.reports`."""
        return self._conditions.reports()

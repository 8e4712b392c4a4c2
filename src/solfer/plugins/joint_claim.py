"""A plugin's claim on the joints that it commands."""

import logging
import math
from collections.abc import Callable, Sequence

import numpy as np

from solfer.errors import ClaimRefused
from solfer.pipes import JointCommandPipe
from solfer.plugins.claim_requests import ClaimRequests
from solfer.recording.model import CLAIMED, LOST, RELEASED
from solfer.throttle import Throttle
from solfer.transport import Middleware
from solfer.transport.lower_level import ALL_OWNERS, REFUSALS_TOPIC, TOPIC
from solfer.transport.messages import REFUSALS, RefusalMessage

logger = logging.getLogger(__name__)

CLAIM_REPEAT_PERIOD = 0.25
"""Time between two requests for a claim that is temporarily refused [s]."""

REFUSAL_GRACE = 0.1
"""Time after a claim in which refusals are ignored: they concern earlier commands; later ones are repeated [s]."""

CLAIM_SETTLING_TIME = 0.15
"""Time for publishers to begin again, before the plugin that follows them does [s]; shorter than a lease."""


class JointClaim:
    """Claims joints from the lower level before anything is sent, follows its refusals, and releases the joints.

    Never blocks.

    Args:
        plugin: Name of the plugin: of its component within the node. Both own the claim, see `claimant`.
        pipes: Its pipes to the lower level.
        middleware: Carries the requests.
        follows: Topics of other plugins that its commands follow.
        publishes: Topics that it publishes to other plugins; the lower level reports when these begin again.
        position: Where the Robot's joints are measured, NaN: they are not, shape (robot.size,) [rad, m]; called at
            each claim. None: nothing is measured.

    Attributes:
        reason: Why the joints are not ours at present, in one line; empty without such a refusal.
        is_taken: Whether that is because others, or the lower level itself, have moved the joints since.
        restarted: Whether that is because the robot was put into another state: all plugins have to begin again.
        refused: How often the lower level reported that it refuses our commands.
        refusals: What the lower level refuses; where none waits, `lost` has nothing new.
        note: Called with kind and text of the event when the joints become ours, are lost, or are given back.
    """

    def __init__(
        self,
        plugin: str,
        pipes: Sequence[JointCommandPipe],
        middleware: Middleware,
        follows: Sequence[str] = (),
        publishes: Sequence[str] = (),
        *,
        position: Callable[[], np.ndarray] | None = None,
    ):
        self._requests = ClaimRequests(plugin, pipes, middleware, follows=tuple(map(_bare, follows)), position=position)
        self._now = middleware.now
        self._topics = frozenset(f"{TOPIC}{_bare(topic)}" for topic in publishes)
        self._granted = not self._requests.commands
        self._since = -math.inf
        self._next = -math.inf
        self._settled = -math.inf
        self.refusals = middleware.queue(REFUSALS_TOPIC, REFUSALS)
        self.reason = ""
        self.restarted = False
        self.is_taken = False
        self.refused = 0
        self.note: Callable[[str, str], None] = lambda kind, text: None
        self._warning = ""
        self._throttle = Throttle(logger)

    def granted(self) -> bool:
        """Return whether the claim is granted; request it if needed, and again after a temporary refusal.

        Raises:
            ClaimRefused: The lower level refuses; names the owner of the joints.
        """
        now = self._now()
        if self._granted:
            self.reason = ""
            return now >= self._settled
        answer = self._requests.claim(may_request=now >= self._next)
        if answer is None:
            return False
        if not answer.success:
            if not answer.later:
                raise ClaimRefused(f"plugin '{self._requests.plugin}' does not get its joints: {answer.message}")
            self.reason = answer.message
            self._next = now + CLAIM_REPEAT_PERIOD
            self.is_taken = True
            return False
        self._granted = True
        self._since = now
        self.reason = ""
        self.is_taken = False
        self.note(CLAIMED, self._requests.description)
        self._settled = now + CLAIM_SETTLING_TIME if answer.again and self._requests.follows else now
        return now >= self._settled

    def lost(self) -> bool:
        """Return whether the lower level refuses our commands because the claim has ended; see `reason`.

        A command that is refused because it is wrong is logged, and returned by `warning`.
        """
        if self.refusals.waits:
            before = self.reason
            for message in self.refusals.drain():
                self._receive(message)
            if self.reason != before:
                self.note(LOST, self.reason)
        return bool(self.reason)

    def restarts(self) -> bool:
        """Return whether the robot was put into another state while the plugin waits; see `restarted`."""
        if self.refusals.waits:
            for message in self.refusals.drain():
                if ALL_OWNERS in message.owners:
                    self.reason = message.reasons[message.owners.index(ALL_OWNERS)]
                    self.restarted = True
        return self.restarted

    def warning(self) -> str:
        """Return what was wrong with commands since the last call; empty: nothing."""
        warning = self._warning
        self._warning = ""
        return warning

    @property
    def released(self) -> bool:
        """Whether every release has been answered."""
        return self._requests.released

    def lapse(self) -> None:
        """Give up the claim without a request, since nothing is sent for a while; it has to be requested again."""
        self.restarted = False
        if self._requests.commands:
            self._granted = False
            self._requests.forget()

    def damp(self) -> None:
        """Trip the robot's emergency stop, which fades out its springs. No effect if the plugin commands no joint."""
        self._requests.damp()

    def release(self) -> None:
        """Release the joints; does not wait for the answer."""
        if self._requests.commands and (self._granted or self._requests.waits):
            self.note(RELEASED, self._requests.description)
            self._requests.release()
        self.lapse()

    def _receive(self, message: RefusalMessage) -> None:
        if self._now() < self._since + REFUSAL_GRACE:
            return
        for owner, claim, reason in zip(message.owners, message.claims, message.reasons, strict=False):
            if owner == ALL_OWNERS:
                self.reason = reason
                self.restarted = True
            elif owner in self._topics:
                self.reason = self.reason or reason
            if owner != self._requests.owner:
                continue
            self.refused += 1
            if claim:
                self.reason = self.reason if self.restarted else reason
                self.is_taken = True
            else:
                self._warning = f"the lower level refuses a command: {reason}"
                self._throttle.warning("command", "%s: %s", self._requests.plugin, self._warning)


def _bare(topic: str) -> str:
    """Strip the leading slash of a topic, which not every middleware has."""
    return topic.lstrip("/")

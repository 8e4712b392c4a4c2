"""A plugin's claim on the joints that it commands."""

import dataclasses
import logging
import math
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any

import numpy as np

from solfer.errors import ClaimRefused, MiddlewareError, ServiceUnavailable
from solfer.pipes import JointCommandPipe
from solfer.recording.model import CLAIMED, LOST_EVENT, RELEASED_EVENT
from solfer.throttle import Throttle
from solfer.transport import Middleware
from solfer.transport.lower_level import (
    ALL_OWNERS,
    CLAIM_INTERFACE,
    LOWER_LEVEL,
    REFUSALS_TOPIC,
    RELEASE,
    TOPIC,
    Answer,
    ClaimAnswer,
    ClaimRequest,
    ReleaseRequest,
    claimant,
)
from solfer.transport.messages import REFUSALS, RefusalMessage
from solfer.transport.middleware import TRIGGER, NoFields

logger = logging.getLogger(__name__)

CLAIM_PATIENCE = 2.0
"""Longest wait for an answer of the lower level [s]."""

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
        note: Called with kind and text of the event when the joints become ours, are lost, or are given back.
    """

    def __init__(
        self,
        plugin: str,
        pipes: Sequence[JointCommandPipe],
        middleware: Middleware,
        follows: Sequence[str] = (),
        publishes: Sequence[str] = (),
        position: Callable[[], np.ndarray] | None = None,
    ):
        self._position = position
        self._pipes = tuple(pipes)
        self._plugin = plugin
        self._middleware = middleware
        self.reason = ""
        pairs = [(pipe.controller, field) for pipe in pipes for field, _ in pipe.fields]
        joints = dict.fromkeys(name for pipe in pipes for name in pipe.sent.names)
        self._claim = ClaimRequest(
            claimant(middleware.name, plugin),
            tuple(name for name, _ in pairs),
            tuple(field for _, field in pairs),
            joints=tuple(joints),
            follows=tuple(map(_bare, follows)),
        )
        self._topics = frozenset(f"{TOPIC}{_bare(topic)}" for topic in publishes)
        self._answer: Future[Any] | None = None
        self._release: Future[Any] | None = None
        self._commands = bool(pairs)
        self._granted = not pairs
        self._since = -math.inf
        self._next = -math.inf
        self._settled = -math.inf
        self._refusals = middleware.queue(REFUSALS_TOPIC, REFUSALS)
        self.restarted = False
        self.is_taken = False
        self.refused = 0
        self.note: Callable[[str, str], None] = lambda kind, text: None
        self._description = f"{', '.join(dict.fromkeys(name for name, _ in pairs))}: {len(joints)} joints"
        self._complaint = ""
        self._throttle = Throttle(logger)

    def granted(self) -> bool:
        """Return whether the claim is granted; request it if needed, and again after a temporary refusal.

        Raises:
            ClaimRefused: The lower level refuses; names the owner of the joints.
        """
        if self._granted:
            self.reason = ""
            return self._middleware.now() >= self._settled
        if self._answer is None:
            self._request()
        if self._answer is None or not self._answer.done():
            return False
        answer = self._reply(self._answer)
        self._answer = None
        if not answer.success:
            if not answer.later:
                raise ClaimRefused(f"plugin '{self._plugin}' does not get its joints: {answer.message}")
            self.reason, self._next = answer.message, self._middleware.now() + CLAIM_REPEAT_PERIOD
            self.is_taken = True
            return False
        now = self._middleware.now()
        self._granted = True
        self._since = now
        self.reason = ""
        self.is_taken = False
        self.note(CLAIMED, self._description)
        self._settled = now + CLAIM_SETTLING_TIME if answer.again and self._claim.follows else now
        return now >= self._settled

    def lost(self) -> bool:
        """Return whether the lower level refuses our commands because the claim has ended; see `reason`.

        A command that is refused because it is wrong is logged, and returned by `complaint`.
        """
        if self._refusals.waits:
            before = self.reason
            for message in self._refusals.drain():
                self._receive(message)
            if self.reason != before:
                self.note(LOST_EVENT, self.reason)
        return bool(self.reason)

    def restarts(self) -> bool:
        """Return whether the robot was put into another state while the plugin waits; see `restarted`."""
        if self._refusals.waits:
            for message in self._refusals.drain():
                if ALL_OWNERS in message.owners:
                    self.reason = message.reasons[message.owners.index(ALL_OWNERS)]
                    self.restarted = True
        return self.restarted

    def complaint(self) -> str:
        """Return what was wrong with commands since the last call; empty: nothing."""
        complaint = self._complaint
        self._complaint = ""
        return complaint

    @property
    def released(self) -> bool:
        """Whether every release has been answered."""
        return self._release is None or self._release.done()

    def lapse(self) -> None:
        """Give up the claim without a request, since nothing is sent for a while; it has to be requested again."""
        self.restarted = False
        if self._commands:
            self._granted = False
            self._answer = None

    def damp(self) -> None:
        """Trip the robot's emergency stop, which fades out its springs. No effect if the plugin commands no joint."""
        if self._commands:
            self._middleware.request(f"{LOWER_LEVEL}/emergency_stop", TRIGGER, NoFields(), Answer, CLAIM_PATIENCE)

    def release(self) -> None:
        """Release the joints; does not wait for the answer."""
        if self._commands and (self._granted or self._answer is not None):
            self.note(RELEASED_EVENT, self._description)
            self._release = self._middleware.request(
                f"{LOWER_LEVEL}/release", RELEASE, ReleaseRequest(self._claim.owner), Answer, CLAIM_PATIENCE
            )
        self.lapse()

    def _request(self) -> None:
        """Request the claim, but only after a release has been answered: it must not end the new claim."""
        if self._middleware.now() < self._next or not self.released:
            return
        claim = dataclasses.replace(self._claim, positions=self._measured())
        self._answer = self._middleware.request(
            f"{LOWER_LEVEL}/claim", CLAIM_INTERFACE, claim, ClaimAnswer, CLAIM_PATIENCE
        )

    def _measured(self) -> tuple[float, ...]:
        """Return where the joints are measured, in the names and numbers of the lower level."""
        if self._position is None:
            return ()
        position = self._position()
        found: dict[str, float] = {}
        for pipe in self._pipes:
            found.update(zip(pipe.sent.names, pipe.to_receiver("position", position[pipe.dofs]).tolist(), strict=True))
        return tuple(found[name] for name in self._claim.joints)

    def _reply(self, answer: "Future[Any]") -> ClaimAnswer:
        try:
            return answer.result()
        except ServiceUnavailable:
            logger.warning("%s commands without a claim: this lower level does not support claims", self._plugin)
            return ClaimAnswer()
        except MiddlewareError as error:
            return ClaimAnswer(False, error.line, later=True)

    def _receive(self, message: RefusalMessage) -> None:
        if self._middleware.now() < self._since + REFUSAL_GRACE:
            return
        for owner, claim, reason in zip(message.owners, message.claims, message.reasons, strict=False):
            if owner == ALL_OWNERS:
                self.reason = reason
                self.restarted = True
            elif owner in self._topics:
                self.reason = self.reason or reason
            if owner != self._claim.owner:
                continue
            self.refused += 1
            if claim:
                self.reason = self.reason if self.restarted else reason
                self.is_taken = True
            else:
                self._complaint = f"the lower level refuses a command: {reason}"
                self._throttle.warning("complaint", "%s: %s", self._plugin, self._complaint)


def _bare(topic: str) -> str:
    """Strip the leading slash of a topic, which not every middleware has."""
    return topic.lstrip("/")

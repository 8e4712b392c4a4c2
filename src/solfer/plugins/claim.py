"""A plugin's claim on the joints that it commands."""

import logging
import math
from collections.abc import Sequence
from concurrent.futures import Future
from typing import Any

from solfer.errors import ClaimRefused, MiddlewareError, NotOffered
from solfer.logs import Throttle
from solfer.pipes import JointController, Middleware
from solfer.pipes.lower_level import (
    CLAIM,
    EVERYBODY,
    LOWER_LEVEL,
    REFUSED,
    RELEASE,
    Answer,
    ClaimAnswer,
    ClaimRequest,
    ReleaseRequest,
)
from solfer.pipes.messages import REFUSALS, RefusalMessage
from solfer.pipes.middleware import TRIGGER, NoFields

logger = logging.getLogger(__name__)

PATIENCE = 2.0
"""Longest time for an answer of the lower level [s]."""

AGAIN = 0.25
"""Time between two requests for a claim that is refused for the time being [s]."""

DEAF = 0.1
"""Time after a claim in which refusals are about what was sent before it; others are repeated [s]."""


class Claim:
    """Asks the lower level for joints before anything is sent, hears whether they stay ours, and gives them back.

    Never blocks.

    Args:
        plugin: Name of the plugin, for messages.
        pipes: Its pipes to the lower level.
        middleware: The way there; its name is the owner of the claim.

    Attributes:
        reason: Why the joints are not ours at present, in one line; empty while nobody has said so.
        began_anew: Whether that is because the robot was put into another state: everybody has to begin anew.
        refused: How often the lower level said that it refuses our commands.
    """

    def __init__(self, plugin: str, pipes: Sequence[JointController], middleware: Middleware):
        self._plugin, self._middleware, self.reason = plugin, middleware, ""
        pairs = [(pipe.name, field) for pipe in pipes for field, _ in pipe.fields]
        joints = dict.fromkeys(name for pipe in pipes for name in pipe.sent.names)
        self._wanted = ClaimRequest(middleware.name, tuple(name for name, _ in pairs),
                                    tuple(field for _, field in pairs), tuple(joints))
        self._answer: Future[Any] | None = None
        self._release: Future[Any] | None = None
        self._commands, self._granted = bool(pairs), not pairs
        self._since, self._next = -math.inf, -math.inf
        self._refusals = middleware.queue(REFUSED, REFUSALS)
        self.began_anew, self.refused = False, 0
        self._complaint, self._throttle = "", Throttle(logger)

    def granted(self) -> bool:
        """Whether the joints are ours; asks for them when nobody has asked yet, and again while they may come later.

        Raises:
            ClaimRefused: The lower level refuses; names who has the joints.
        """
        if self._granted:
            self._refusals.drain()  # about what was before
            self.reason = ""
            return True
        if self._answer is None:
            self._ask()
        if self._answer is None or not self._answer.done():
            return False
        answer, self._answer = self._reply(self._answer), None
        if not answer.success:
            if not answer.later:
                raise ClaimRefused(f"plugin '{self._plugin}' does not get its joints: {answer.message}")
            self.reason, self._next = answer.message, self._middleware.now() + AGAIN
            return False
        self._granted, self._since, self.reason = True, self._middleware.now(), ""
        return True

    def lost(self) -> bool:
        """Whether the lower level refuses our commands because the joints are not ours any more; see `reason`.

        A command that is refused because it is wrong is logged, and said by `complaint`.
        """
        for message in self._refusals.drain():
            self._hear(message)
        return bool(self.reason)

    def complaint(self) -> str:
        """What was wrong with commands since the last call; empty: nothing."""
        complaint, self._complaint = self._complaint, ""
        return complaint

    @property
    def released(self) -> bool:
        """Whether no answer to a release is outstanding."""
        return self._release is None or self._release.done()

    def lapse(self) -> None:
        """Nothing is sent for a while: the claim has to be asked for again."""
        self.began_anew = False
        if self._commands:
            self._granted, self._answer = False, None

    def damp(self) -> None:
        """Let the springs of the robot fade out: its emergency stop. Does nothing for who commands no joint."""
        if self._commands:
            self._middleware.request(f"{LOWER_LEVEL}/emergency_stop", TRIGGER, NoFields(), Answer, PATIENCE)

    def release(self) -> None:
        """Give the joints back; does not wait for the answer."""
        if self._commands and (self._granted or self._answer is not None):
            self._release = self._middleware.request(
                f"{LOWER_LEVEL}/release", RELEASE, ReleaseRequest(self._wanted.owner), Answer, PATIENCE)
        self.lapse()

    def _ask(self) -> None:
        """Ask for the joints, not before a release has been answered: it must not end the new claim."""
        if self._middleware.now() < self._next or not self.released:
            return
        self._answer = self._middleware.request(f"{LOWER_LEVEL}/claim", CLAIM, self._wanted, ClaimAnswer, PATIENCE)

    def _reply(self, answer: "Future[Any]") -> ClaimAnswer:
        try:
            return answer.result()
        except NotOffered:
            logger.warning("%s commands without a claim: this lower level does not know who commands it", self._plugin)
            return ClaimAnswer()
        except MiddlewareError as error:
            return ClaimAnswer(False, error.line, later=True)

    def _hear(self, message: RefusalMessage) -> None:
        if self._middleware.now() < self._since + DEAF:
            return
        for owner, claim, reason in zip(message.owners, message.claims, message.reasons, strict=False):
            if owner == EVERYBODY:
                self.reason, self.began_anew = reason, True
            if owner != self._wanted.owner:
                continue
            self.refused += 1
            if claim:
                self.reason = self.reason if self.began_anew else reason
            else:
                self._complaint = f"the lower level refuses a command: {reason}"
                self._throttle.warning("complaint", "%s: %s", self._plugin, self._complaint)

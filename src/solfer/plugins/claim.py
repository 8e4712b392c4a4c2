"""A plugin's claim on the joints that it is going to command."""

import logging
from collections.abc import Sequence
from concurrent.futures import Future

from solfer.errors import ClaimRefused, NotOffered
from solfer.pipes import JointController, Middleware
from solfer.pipes.lower_level import CLAIM, LOWER_LEVEL, RELEASE, Answer, ClaimRequest, ReleaseRequest

logger = logging.getLogger(__name__)

PATIENCE = 2.0
"""Longest time for an answer of the lower level [s]."""


class Claim:
    """Asks the lower level for joints before anything is sent, and gives them back in the end. Never blocks.

    Args:
        plugin: Name of the plugin, for messages.
        pipes: Its pipes to the lower level.
        middleware: The way there; its name is the owner of the claim.
    """

    def __init__(self, plugin: str, pipes: Sequence[JointController], middleware: Middleware):
        self._plugin, self._middleware = plugin, middleware
        pairs = [(pipe.name, field) for pipe in pipes for field, _ in pipe.fields]
        joints = dict.fromkeys(name for pipe in pipes for name in pipe.sent.names)
        self._wanted = ClaimRequest(middleware.name, tuple(name for name, _ in pairs),
                                    tuple(field for _, field in pairs), tuple(joints))
        self._answer: Future[Answer] | None = None
        self._granted = False

    def granted(self) -> bool:
        """Whether the joints are ours; asks for them if nobody has asked yet.

        Raises:
            ClaimRefused: The lower level refuses; names who has the joints.
            MiddlewareError: The lower level does not answer.
        """
        if self._granted or not self._wanted.controllers:
            return True
        if self._answer is None:
            self._answer = self._middleware.request(f"{LOWER_LEVEL}/claim", CLAIM, self._wanted, Answer, PATIENCE)
        if not self._answer.done():
            return False
        try:
            answer = self._answer.result()
        except NotOffered:
            logger.warning("%s commands without a claim: this lower level does not know who commands it", self._plugin)
            answer = Answer()
        if not answer.success:
            self._answer = None
            raise ClaimRefused(f"plugin '{self._plugin}' does not get its joints: {answer.message}")
        self._granted = True
        return True

    def lapse(self) -> None:
        """Nothing is sent for a while: the claim has to be asked for again."""
        self._granted, self._answer = False, None

    def release(self) -> None:
        """Give the joints back; does not wait for the answer."""
        if self._answer is not None:
            self._middleware.request(f"{LOWER_LEVEL}/release", RELEASE, ReleaseRequest(self._wanted.owner), Answer,
                                     PATIENCE)
        self.lapse()

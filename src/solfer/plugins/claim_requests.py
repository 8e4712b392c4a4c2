"""Requests of a plugin to the lower level, for the joints that it commands."""

import dataclasses
import logging
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any

import numpy as np

from solfer.errors import MiddlewareError, ServiceUnavailable
from solfer.pipes import JointCommandPipe
from solfer.transport import Middleware
from solfer.transport.lower_level import (
    CLAIM_INTERFACE,
    LOWER_LEVEL,
    RELEASE,
    Answer,
    ClaimAnswer,
    ClaimRequest,
    ReleaseRequest,
    claimant,
)
from solfer.transport.middleware import TRIGGER, NoFields

logger = logging.getLogger(__name__)


class ClaimRequests:
    """Requests that claim joints, release them, or damp the robot. Never blocks.

    Args:
        plugin: Name of the plugin.
        pipes: Its pipes to the lower level.
        middleware: Carries the requests.
        follows: Topics of other plugins that its commands follow, without a leading slash.
        position: Where the Robot's joints are measured; see `JointClaim`.

    Attributes:
        plugin: See above.
        follows: See above.
        commands: Whether the plugin commands any joint.
        description: The joints, in a few words.
    """

    def __init__(
        self,
        plugin: str,
        pipes: Sequence[JointCommandPipe],
        middleware: Middleware,
        follows: tuple[str, ...],
        position: Callable[[], np.ndarray] | None,
    ):
        pairs = [(pipe.controller, field) for pipe in pipes for field, _ in pipe.fields]
        joints = tuple(dict.fromkeys(name for pipe in pipes for name in pipe.sent.names))
        self.plugin = plugin
        self.follows = follows
        self.commands = bool(pairs)
        self.description = f"{', '.join(dict.fromkeys(name for name, _ in pairs))}: {len(joints)} joints"
        self._pipes = tuple(pipes)
        self._middleware = middleware
        self._position = position
        self._claim = ClaimRequest(
            claimant(middleware.name, plugin),
            tuple(name for name, _ in pairs),
            tuple(field for _, field in pairs),
            joints=joints,
            follows=follows,
        )
        self._answer: Future[Any] | None = None
        self._release: Future[Any] | None = None

    @property
    def owner(self) -> str:
        """Name by which the lower level knows the plugin."""
        return self._claim.owner

    @property
    def waits(self) -> bool:
        """Whether a claim was requested and not answered yet."""
        return self._answer is not None

    @property
    def released(self) -> bool:
        """Whether every release has been answered."""
        return self._release is None or self._release.done()

    def claim(self, may_request: bool) -> ClaimAnswer | None:
        """Return the answer to the claim; request it if that may be and is not done yet. None: no answer so far.

        It is requested only after a release has been answered, which must not end the new claim.
        """
        if self._answer is None and may_request and self.released:
            claim = dataclasses.replace(self._claim, positions=self._measured())
            self._answer = self._request("claim", CLAIM_INTERFACE, claim, ClaimAnswer)
        if self._answer is None or not self._answer.done():
            return None
        answer = self._reply(self._answer)
        self._answer = None
        return answer

    def forget(self) -> None:
        """Leave a claim that was requested unanswered."""
        self._answer = None

    def release(self) -> None:
        """Release the joints; does not wait for the answer."""
        self._release = self._request("release", RELEASE, ReleaseRequest(self.owner), Answer)

    def damp(self) -> None:
        """Trip the robot's emergency stop, which fades out its springs. No effect if the plugin commands no joint."""
        if self.commands:
            self._request("emergency_stop", TRIGGER, NoFields(), Answer)

    def _request(self, service: str, interface: str, fields: object, reply: type) -> "Future[Any]":
        timeout = 2.0  # longest wait for an answer of the lower level [s]
        return self._middleware.request(f"{LOWER_LEVEL}/{service}", interface, fields, reply, timeout)

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
            logger.warning("%s commands without a claim: this lower level does not support claims", self.plugin)
            return ClaimAnswer()
        except MiddlewareError as error:
            return ClaimAnswer(False, error.line, later=True)

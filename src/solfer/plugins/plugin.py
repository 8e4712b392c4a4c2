"""A plugin: one component on one Robot with its pipes, cycle by cycle."""

import enum
import logging
from collections.abc import Callable, Sequence

from solfer.components import Component
from solfer.errors import NotFinite
from solfer.pipes import Inbox, JointController, JointFeedback
from solfer.plugins.claim import Claim
from solfer.plugins.safety import Gate
from solfer.robot import Robot

logger = logging.getLogger(__name__)

STRIKES = 10
"""Periods without a new message of a required feedback until the plugin holds."""

PATIENCE = 0.2
"""Shortest time without a new message of a required feedback until the plugin holds [s]."""


class Life(enum.Enum):
    """Stages of a plugin. WAITING: a required feedback or the claim on joints is missing; nothing is sent."""

    WAITING = "waiting"
    RUNNING = "running"
    STOPPED = "stopped"
    CLOSED = "closed"


class Plugin:
    """One component on one Robot.

    The component starts as soon as every required feedback has arrived and the joints are its own. When a feedback
    falls silent, the plugin holds: wheels at zero, positions as they were sent last; it starts anew from the measured
    state when all are back.

    Args:
        component: The algorithm.
        robot: The Robot that it works on.
        feedbacks: Pipes in, in the order of the configuration.
        controllers: Pipes out, each with its gate, or None where it does not go to the lower level.
        inbox: Calls from outside.
        rate: Cycles per second [Hz].
        now: Clock of the pipes [s].
        claim: Its claim on the joints that it commands; None: it commands none.

    Attributes:
        life: Stage of the plugin.
        transport: Time that the newest cycle spent in handing over what it sends [s].
    """

    def __init__(
        self,
        component: Component,
        robot: Robot,
        feedbacks: Sequence[JointFeedback],
        controllers: Sequence[tuple[JointController, Gate | None]],
        inbox: Inbox,
        rate: float,
        now: Callable[[], float],
        claim: Claim | None = None,
    ):
        self.component, self.robot, self.rate = component, robot, rate
        self.feedbacks, self.controllers, self.inbox = tuple(feedbacks), tuple(controllers), inbox
        self.life, self.transport = Life.WAITING, 0.0
        self._now, self._claim = now, claim
        self._required = [feedback for feedback in self.feedbacks if feedback.required]
        self._oldest = max(PATIENCE, STRIKES / rate)
        self._refuse()

    @property
    def name(self) -> str:
        """Name of the plugin's configuration."""
        return self.component.name

    def cycle(self) -> None:
        """One control cycle, from what came in to what goes out; nothing after the end.

        Raises:
            NotFinite: The component wants a number that is none; nothing of that pipe was sent.
            ClaimRefused: Somebody else commands a joint of this plugin; nothing was sent.
        """
        self.transport = 0.0
        self.inbox.apply()
        if self.life in (Life.STOPPED, Life.CLOSED):
            return
        for feedback in self.feedbacks:
            feedback.run()
        if not self._fresh():
            if self.life is Life.RUNNING:
                self._pause()
            return
        if self.life is Life.WAITING and self._claim is not None and not self._claim.granted():
            return
        if self.component.kinematics or self.life is Life.WAITING:
            self.robot.update()
        if self.life is Life.WAITING:
            self._start()
        self.component.update()
        self.component.send()
        self._send()

    def stop(self) -> None:
        """Bring the robot to rest and send that: the component's own way first, then wheels at zero in any case."""
        if self.life not in (Life.WAITING, Life.RUNNING):
            return
        was_running = self.life is Life.RUNNING
        self.life = Life.STOPPED
        self.inbox.refusal = f"plugin '{self.name}' has stopped"
        self.inbox.apply()
        try:
            if was_running:
                self._come_to_rest()
        finally:
            if self._claim is not None:
                self._claim.release()

    def close(self) -> None:
        """Release what the component holds."""
        if self.life is not Life.CLOSED:
            self.life = Life.CLOSED
            self.component.close()

    def _fresh(self) -> bool:
        """Whether every required feedback has brought something since the start and is not too old."""
        return all(feedback.accepted and feedback.reader.age() <= self._oldest for feedback in self._required)

    def _start(self) -> None:
        self.component.init()
        self.life, self.inbox.refusal = Life.RUNNING, ""
        logger.info("%s runs at %g Hz", self.name, self.rate)

    def _pause(self) -> None:
        silent = [f"'{item.name}' ({item.reader.topic})" for item in self._required if item.reader.age() > self._oldest]
        logger.warning("%s holds: no news for %.2g s on %s", self.name, self._oldest, ", ".join(silent))
        self._hold()
        self.life = Life.WAITING
        if self._claim is not None:
            self._claim.lapse()
        self._refuse()

    def _refuse(self) -> None:
        names = ", ".join(f"'{feedback.name}'" for feedback in self._required)
        self.inbox.refusal = f"plugin '{self.name}' waits for feedback {names}"

    def _come_to_rest(self) -> None:
        try:
            self.component.stop()
            self.component.send()
        finally:
            self._hold()

    def _hold(self) -> None:
        """Send zero velocities and the present positions. A pipe whose numbers are not finite is left out: the lower
        level keeps what it has.
        """
        self.robot.command.velocity[:] = 0.0
        for pipe, gate in self.controllers:
            pipe.collect()
            try:
                if gate is not None:
                    gate.check()
            except NotFinite as error:
                logger.error("%s", error)
            else:
                pipe.send(self._now())

    def _send(self) -> None:
        for pipe, gate in self.controllers:
            pipe.collect()
            if gate is not None:
                gate.check()
        stamp = self._now()
        for pipe, _ in self.controllers:
            pipe.send(stamp)
        self.transport = self._now() - stamp

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
    """Stages of a plugin. WAITING: a required feedback or the claim on its joints is missing; nothing is sent."""

    WAITING = "waiting"
    RUNNING = "running"
    STOPPED = "stopped"
    CLOSED = "closed"


class Plugin:
    """One component on one Robot.

    The component starts as soon as every required feedback has arrived and the joints are its own. When a feedback
    falls silent, or the lower level does not let it command its joints any more, the plugin holds: wheels at zero,
    positions as they were sent last. It starts anew from the measured state when it has both again.

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
        # made before the first cycle: to load what is behind it takes a while
        self._dynamics = robot.dynamics if component.dynamics else None
        self._required = [feedback for feedback in self.feedbacks if feedback.required]
        self._oldest = max(PATIENCE, STRIKES / rate)
        self._lacks = ""
        self._wait_for(self._silence(), logging.DEBUG)

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
        if not self._ready():
            return
        if self.component.kinematics or self.life is Life.WAITING:
            self.robot.update()
        if self.life is Life.WAITING:
            self._start()
        if self._dynamics is not None:
            self._dynamics.update()
        self.component.update()
        self.component.send()
        if self.component.modify:
            # pipes that tell of links, and whoever shares the Robot, see what the component made of it
            self.robot.update()
        self._send()

    def health(self) -> tuple[int, str]:
        """Health since the last call: level 0 good, 1 warning, 2 error, and one sentence."""
        if self.life is Life.WAITING:
            refused = self._claim is not None and self._claim.reason
            return 2 if refused else 1, f"holds and waits {self._lacks}"
        complaint = self._claim.complaint() if self._claim is not None else ""
        return (1, complaint) if complaint else (0, self.life.value)

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

    def _ready(self) -> bool:
        """Whether the robot is heard and the joints are ours; if not, the plugin waits for what it lacks."""
        running = self.life is Life.RUNNING
        if not self._fresh():
            if running:
                self._hold()
                if self._claim is not None:
                    self._claim.lapse()
            self._wait_for(self._silence(), logging.WARNING if running else logging.INFO)
            return False
        if self._claim is None:
            return True
        if self._claim.lost() if running else not self._claim.granted():
            reason = self._claim.reason
            if running:
                self._hold()
                self._claim.release()
            self._wait_for(f"for its joints: {reason or 'not answered yet'}", logging.ERROR if reason else logging.DEBUG)
            return False
        return True

    def _fresh(self) -> bool:
        """Whether every required feedback has brought something since the start and is not too old."""
        return all(feedback.accepted and feedback.reader.age() <= self._oldest for feedback in self._required)

    def _silence(self) -> str:
        """Which feedbacks are missing."""
        silent = [f"'{feedback.name}' ({feedback.reader.topic})" for feedback in self._required
                  if not feedback.accepted or feedback.reader.age() > self._oldest]
        return f"for feedback {', '.join(silent)}" if silent else "for its first cycle"

    def _wait_for(self, lacks: str, level: int) -> None:
        """Do nothing until there is what the plugin lacks; says so if it is news."""
        self.life = Life.WAITING
        if lacks == self._lacks:
            return
        self._lacks = lacks
        self.inbox.refusal = f"plugin '{self.name}' waits {lacks}"
        logger.log(level, "%s holds and waits %s", self.name, lacks)

    def _start(self) -> None:
        self.component.init()
        self.life, self.inbox.refusal, self._lacks = Life.RUNNING, "", ""
        logger.info("%s runs at %g Hz", self.name, self.rate)

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
            pipe.reset()  # a filter would go on with the speed that was wanted before
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

"""A plugin: one component on one Robot with its pipes, cycle by cycle."""

import enum
import logging
import math
from collections.abc import Callable, Sequence

from solfer.components import Component
from solfer.errors import MiddlewareError, NotFinite, NotHeard
from solfer.pipes import Controller, Feedback, Inbox, Middleware
from solfer.plugins.claim import Claim
from solfer.plugins.outputs import Outputs
from solfer.plugins.safety import Gate
from solfer.plugins.stages import Stages
from solfer.plugins.watch import Watch, Watches
from solfer.robot import Robot

logger = logging.getLogger(__name__)

FIRST = 60.0
"""Longest wait for the first messages of all required feedbacks [s]."""

SETTLE = 0.1
"""Time after a simulation began anew until what is heard is about its new beginning [s]."""


class Life(enum.Enum):
    """Stages of a plugin. WAITING: a required feedback or the claim on its joints is missing; nothing is sent."""

    WAITING = "waiting"
    RUNNING = "running"
    STOPPED = "stopped"
    CLOSED = "closed"


class Plugin:
    """One component on one Robot.

    The component starts as soon as every required feedback has arrived and the joints are its own. When a feedback
    falls silent that it cannot do without, or the lower level does not let it command its joints any more, the plugin
    holds: wheels at zero, positions as they were sent last. It starts anew from the measured state when it has both
    again; it does so as well, without a command in between, when the simulation begins anew.

    Args:
        component: The algorithm.
        robot: The Robot that it works on.
        watches: Pipes in, in the order of the configuration, and how long each may be silent.
        controllers: Pipes out, each with its gate, or None where it does not go to the lower level.
        inbox: Calls from outside.
        rate: Cycles per second [Hz].
        middleware: The clock of the pipes.
        claim: Its claim on the joints that it commands; None: it commands none.

    Attributes:
        life: Stage of the plugin.
        transport: Time that the newest cycle spent in handing over what it sends [s].
        stages: Times of the stages of the newest cycle.
        outputs: Blends commands in and holds without a step; None: commands go out as they are wanted.
    """

    def __init__(
        self,
        component: Component,
        robot: Robot,
        watches: Sequence[Watch],
        controllers: Sequence[tuple[Controller, Gate | None]],
        inbox: Inbox,
        rate: float,
        middleware: Middleware,
        claim: Claim | None = None,
    ):
        self.component, self.robot, self.rate = component, robot, rate
        self.controllers, self.inbox = tuple(controllers), inbox
        self.life, self.transport = Life.WAITING, 0.0
        self._watches, self._middleware, self._now = Watches(watches), middleware, middleware.now
        self._claim, self._rewinds = claim, middleware.rewinds
        self.stages, self.outputs = Stages(), None
        # made before the first cycle: to load what is behind it takes a while
        self._dynamics = robot.dynamics if component.dynamics else None
        self._latest, self._earliest, self._lacks = None, -math.inf, ""
        self._wait_for(self._missing(), logging.DEBUG)

    @property
    def feedbacks(self) -> tuple[Feedback, ...]:
        """Pipes in, in the order of the configuration."""
        return self._watches.feedbacks

    @property
    def name(self) -> str:
        """Name of the plugin's configuration."""
        return self.component.name

    def cycle(self) -> None:
        """One control cycle, from what came in to what goes out; nothing after the end.

        Raises:
            NotFinite: The component wants a number that is none; nothing of that pipe was sent.
            ClaimRefused: Somebody else commands a joint of this plugin; nothing was sent.
            NotHeard: A required feedback did not come in time.
            MiddlewareError: A feedback is silent that the plugin shall not outlive.
        """
        self.transport = 0.0
        self.stages.begin()
        self.inbox.apply()
        self.stages.done(0)
        if self.life in (Life.STOPPED, Life.CLOSED):
            return
        ready = self._ready()
        self.stages.done(1)
        if not ready:
            return
        if self.component.kinematics or self.life is Life.WAITING:
            self.robot.update()
        if self.life is Life.WAITING:
            self._start()
        if self._dynamics is not None:
            self._dynamics.update()
        self.stages.done(2)
        self.component.update()
        self.component.send()
        self.stages.done(3)
        if self.component.modify:
            # pipes that tell of links, and whoever shares the Robot, see what the component made of it
            self.robot.update()
        self._send()

    def health(self) -> tuple[int, str]:
        """Health since the last call: level 0 good, 1 warning, 2 error, and one sentence."""
        if self.life is Life.WAITING:
            refused = self._claim is not None and self._claim.reason
            return 2 if refused else 1, f"holds and waits {self._lacks}"
        complaint, kept = self._claim.complaint() if self._claim is not None else "", self._watches.kept()
        if kept and not complaint:
            complaint = f"goes on with what was said last by feedback {kept}"
        return (1, complaint) if complaint else (0, self.life.value)

    def figures(self) -> dict[str, float | str]:
        """Figures for health reports: each feedback, and what was held back of the commands since the start."""
        counts: dict[str, float | str] = {}
        for _, gate in self.controllers:
            for kind, count in gate.counts.items() if gate is not None else ():
                counts[f"gate: {kind}"] = counts.get(f"gate: {kind}", 0) + count
        if self._claim is not None:
            counts["refused by the lower level"] = self._claim.refused
        return {**self._watches.figures(self._now()), **counts}

    def stop(self) -> None:
        """Bring the robot to rest and send that: the component's own way first, then wheels at zero in any case."""
        self._finish(self._come_to_rest)

    def abort(self) -> None:
        """As `stop`, but the component, which has failed, is not asked: the robot holds."""
        self._finish(self._hold)

    def restart(self) -> None:
        """Go on after `stop` or `abort`: start from the measured state as soon as it is heard again."""
        if self.life is Life.STOPPED:
            self._watches.restart()
            self._latest, self._lacks = None, ""
            self._wait_for(self._missing(), logging.DEBUG)

    def blend_in(self, duration: float) -> None:
        """Blend the commands of each start in from the measured state, for `duration` [s]."""
        pipes = [pipe for pipe, gate in self.controllers if gate is not None]
        self.outputs = Outputs(pipes, self.robot.state, 1.0 / self.rate, duration)

    @property
    def running(self) -> bool:
        """Whether its component runs: everything that it needs is there."""
        return self.life is Life.RUNNING

    @property
    def released(self) -> bool:
        """Whether the joints were given back, and the lower level has said so."""
        return self._claim is None or self._claim.released

    def close(self) -> None:
        """Release what the component holds."""
        if self.life is not Life.CLOSED:
            self.life = Life.CLOSED
            self.component.close()

    def _finish(self, rest: Callable[[], None]) -> None:
        """Stop for good; `rest` sends the last commands, if there were any before."""
        if self.life not in (Life.WAITING, Life.RUNNING):
            return
        was_running = self.life is Life.RUNNING
        self.life = Life.STOPPED
        self.inbox.refusal = f"plugin '{self.name}' has stopped"
        self.inbox.apply()
        try:
            if was_running:
                rest()
        finally:
            if self._claim is not None:
                self._claim.release()

    def _ready(self) -> bool:
        """Whether the robot is heard and the joints are ours; if not, the plugin waits for what it lacks."""
        now = self._now()
        if self._middleware.rewinds != self._rewinds:
            self._rewinds = self._middleware.rewinds
            self._begin_anew(now, "time has gone back")
        if not self._watches.run(now):
            self._miss(now)
            return False
        if now < self._earliest:
            return False
        return self._claim is None or self._owns(now)

    def _miss(self, now: float) -> None:
        """A feedback is missing: hold, and wait for it."""
        running, action, missing = self.life is Life.RUNNING, self._watches.action(), self._missing()
        if running:
            if action == "stop":
                raise MiddlewareError(f"nothing new {missing}, and its 'on_timeout' is 'stop'")
            self._hold()
            if self._claim is not None:
                if action == "damp":
                    self._claim.damp()
                self._claim.lapse()
        elif self._latest is None:
            self._latest = now + FIRST
        elif now > self._latest:
            raise NotHeard(f"plugin '{self.name}' has waited {FIRST:g} s {missing}",
                           expected="somebody who tells it, or `initialize: false`")
        self._wait_for(missing, logging.WARNING if running else logging.INFO)

    def _owns(self, now: float) -> bool:
        """Whether the joints are ours; if not, the plugin holds and waits for them."""
        running, claim = self.life is Life.RUNNING, self._claim
        if not (claim.lost() if running else not claim.granted()):
            return True
        if running and claim.began_anew:
            self._begin_anew(now, claim.reason)
            return False
        if running:
            self._hold()
            claim.release()
        reason = claim.reason
        self._wait_for(f"for its joints: {reason or 'not answered yet'}", logging.ERROR if reason else logging.DEBUG)
        return False

    def _begin_anew(self, now: float, reason: str) -> None:
        """The robot is in another state than a moment ago: forget what was heard and wanted, send nothing."""
        logger.warning("%s starts anew: %s", self.name, reason)
        self._watches.restart()
        for pipe, _ in self.controllers:
            pipe.reset()
        if self._claim is not None:
            self._claim.lapse()
        self._earliest = now + SETTLE
        self._wait_for(self._missing(), logging.DEBUG)

    def _missing(self) -> str:
        """Which feedbacks are missing."""
        lacks = self._watches.lacks()
        return f"for feedback {lacks}" if lacks else "for its first cycle"

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
        if self.outputs is not None:
            self.outputs.start()
        self.life, self.inbox.refusal, self._lacks = Life.RUNNING, "", ""
        self._latest = math.inf
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
        if self.outputs is not None:
            self.outputs.hold(self._now())
            return
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
        if self.outputs is not None:
            self.outputs.blend()
        self.stages.done(4)
        stamp = self._now()
        for pipe, _ in self.controllers:
            pipe.send(stamp)
        self.transport = self._now() - stamp
        self.stages.done(5)

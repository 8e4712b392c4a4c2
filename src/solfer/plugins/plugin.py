"""A plugin: one component on one Robot with its pipes, cycle by cycle."""

import enum
import logging
from collections.abc import Callable, Sequence

from solfer.components import Component
from solfer.errors import NotFinite
from solfer.pipes import Feedback, Inbox, Middleware
from solfer.plugins.claim import Claim
from solfer.plugins.outputs import Outputs
from solfer.plugins.readiness import Readiness, Verdict
from solfer.plugins.stages import Stages
from solfer.plugins.watch import Watch, Watches
from solfer.robot import Robot

logger = logging.getLogger(__name__)


class Life(enum.Enum):
    """Stages of a plugin. WAITING: a required feedback or the claim on its joints is missing; nothing is sent."""

    WAITING = "waiting"
    RUNNING = "running"
    STOPPED = "stopped"
    CLOSED = "closed"


WAITING, RUNNING, STOPPED, CLOSED = Life  # found in a fifth of the time, for what runs in every cycle


class Plugin:
    """One component on one Robot.

    The component starts as soon as every required feedback has arrived and the joints are its own. When a feedback
    falls silent that it cannot do without, or the lower level does not let it command its joints any more, the plugin
    holds: wheels at zero, positions as they were sent last. It starts anew from the measured state when it has both
    again; it does so as well, after `Component.reset` and without a command in between, when the simulation begins
    anew.

    Args:
        component: The algorithm.
        robot: The Robot that it works on.
        watches: Pipes in, in the order of the configuration, and how long each may be silent.
        outputs: Pipes out.
        inbox: Calls from outside.
        rate: Cycles per second [Hz].
        middleware: The clock of the pipes.
        claim: Its claim on the joints that it commands; None: it commands none.

    Attributes:
        life: Stage of the plugin.
        transport: Time that the newest cycle spent in handing over what it sends [s].
        stages: Times of the stages of the newest cycle.
    """

    def __init__(
        self,
        component: Component,
        robot: Robot,
        watches: Sequence[Watch],
        outputs: Outputs,
        inbox: Inbox,
        rate: float,
        middleware: Middleware,
        claim: Claim | None = None,
    ):
        self.component, self.robot, self.rate = component, robot, rate
        self.outputs, self.inbox = outputs, inbox
        self.life, self.transport = WAITING, 0.0
        self._watches, self._now, self._claim = Watches(watches), middleware.now, claim
        self._readiness = Readiness(self.name, self._watches, middleware, claim)
        self.stages = Stages()
        # made before the first cycle: to load what is behind it takes a while
        self._dynamics = robot.dynamics if component.dynamics else None
        self._lacks = ""
        self._wait()

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
        life = self.life
        if life is STOPPED or life is CLOSED:
            return
        ready = self._ready()
        self.stages.done(1)
        if not ready:
            return
        if life is WAITING or self.component.kinematics:
            self.robot.update()
        if life is WAITING:
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
        level, summary = self._readiness.health(self.life is not WAITING)
        return level, summary or self.life.value

    def figures(self) -> dict[str, float | str]:
        """Figures for health reports: each feedback, and what was held back of the commands since the start."""
        return {**self._readiness.figures(), **self.outputs.counts()}

    def stop(self) -> None:
        """Bring the robot to rest and send that: the component's own way first, then wheels at zero in any case."""
        self._finish(self._come_to_rest)

    def abort(self) -> None:
        """As `stop`, but the component, which has failed, is not asked: the robot holds."""
        self._finish(self._hold)

    def restart(self) -> None:
        """Go on after `stop` or `abort`: start from the measured state as soon as it is heard again."""
        if self.life is STOPPED:
            self._readiness.restart()
            self._wait()

    def blend_in(self, shortest: float) -> None:
        """Where commands blend in from the measured state at a start, take at least the time `shortest` [s] for it."""
        self.outputs.blend.shortest = shortest

    @property
    def running(self) -> bool:
        """Whether its component runs: everything that it needs is there."""
        return self.life is RUNNING

    @property
    def released(self) -> bool:
        """Whether the joints were given back, and the lower level has said so."""
        return self._claim is None or self._claim.released

    def close(self) -> None:
        """Release what the component holds."""
        if self.life is not CLOSED:
            self.life = CLOSED
            self.component.close()

    def _finish(self, rest: Callable[[], None]) -> None:
        """Stop for good; `rest` sends the last commands, if there were any before."""
        if self.life not in (WAITING, RUNNING):
            return
        was_running = self.life is RUNNING
        self.life = STOPPED
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
        verdict = self._readiness.look(self.life is RUNNING)
        if verdict is Verdict.WORK:
            return True
        if verdict is Verdict.HOLD:
            self._hold()
            self._readiness.let_go()
        began_anew = verdict is Verdict.FORGET and self.life is RUNNING
        self._wait()
        if began_anew:
            self.component.reset()
        return False

    def _wait(self) -> None:
        """Do nothing until there is what the plugin lacks; says so if it is news."""
        self.life, lacks = WAITING, self._readiness.lacks
        if lacks == self._lacks:
            return
        self._lacks = lacks
        self.inbox.refusal = f"plugin '{self.name}' waits {lacks}"
        logger.log(self._readiness.level, "%s holds and waits %s", self.name, lacks)

    def _start(self) -> None:
        self.component.init()
        self.outputs.start()
        self.life, self.inbox.refusal, self._lacks = RUNNING, "", ""
        self._readiness.started()
        logger.info("%s runs at %g Hz", self.name, self.rate)

    def _come_to_rest(self) -> None:
        try:
            self.component.stop()
            self.component.send()
            self.outputs.rest(self._now())
        except NotFinite as error:
            logger.error("%s", error)
            self._hold()
        except Exception:
            self._hold()
            raise

    def _hold(self) -> None:
        self.outputs.hold(self._now())

    def _send(self) -> None:
        self.outputs.collect()
        self.stages.done(4)
        stamp = self._now()
        self.outputs.send(stamp)
        self.transport = self._now() - stamp
        self.stages.done(5)

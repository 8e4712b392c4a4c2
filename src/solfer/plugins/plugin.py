"""A plugin: one component on one Robot with its pipes, cycle by cycle."""

import enum
import logging
from collections.abc import Callable, Sequence

from solfer.components import Component
from solfer.errors import NotFinite
from solfer.pipes import FeedbackPipe
from solfer.plugins.cycle_timing import CycleTiming
from solfer.plugins.feedback_timeout import FeedbackTimeout, FeedbackTimeouts
from solfer.plugins.joint_claim import JointClaim
from solfer.plugins.outputs.outputs import Outputs
from solfer.plugins.peers import Peers
from solfer.plugins.start_conditions import CycleVerdict, StartConditions
from solfer.robot import Robot
from solfer.transport import Inbox, Middleware

logger = logging.getLogger(__name__)


class LoopState(enum.Enum):
    """State of a plugin's loop. WAITING: without a required feedback or its claim on joints; it sends nothing."""

    WAITING = "waiting"
    RUNNING = "running"
    STOPPED = "stopped"
    CLOSED = "closed"


# module globals: the lookup in the control cycle is five times as fast as on the class
WAITING, RUNNING, STOPPED, CLOSED = LoopState


class Plugin:
    """One component on one Robot.

    The component starts as soon as every required feedback has arrived and the claim on its joints is granted. When a
    feedback times out that it cannot do without, or the lower level refuses its commands, the plugin holds: wheels at
    zero, positions as they were sent last. After `Component.reset` it starts anew from the measured state when it has
    both again. It also starts anew

    - when the simulation begins anew, without a command in between,
    - when its own loop stood still (a debugger, swap, a suspended laptop): earlier requests may be outdated,
    - when a plugin that follows it starts anew.

    Args:
        component: The algorithm.
        robot: The Robot that it works on.
        watches: Pipes in, in the order of the configuration, each with its timeout.
        outputs: Pipes out.
        inbox: Calls from outside.
        rate: Cycles per second [Hz].
        middleware: The clock of the pipes.
        claim: Its claim on the joints that it commands; None: it commands none.
        peers: Supervises the other ends of its pipes; None: they are not supervised.
        stall: Lateness of its own loop at which it begins anew [s]; see `StartConditions`.

    Attributes:
        life: State of the plugin's loop.
        peers: See above; the loop calls its `look` about once a second, outside of `cycle`.
        transport: Time that the newest cycle spent on publishing its commands [s].
        timing: Times of the stages of the newest cycle.
    """

    def __init__(
        self,
        component: Component,
        robot: Robot,
        watches: Sequence[FeedbackTimeout],
        outputs: Outputs,
        inbox: Inbox,
        rate: float,
        middleware: Middleware,
        claim: JointClaim | None = None,
        peers: Peers | None = None,
        stall: float | None = None,
    ):
        self.component, self.robot, self.rate = component, robot, rate
        self.outputs, self.inbox = outputs, inbox
        self.peers = peers or Peers(self.name, (), middleware)
        self.life, self.transport = WAITING, 0.0
        self._feedback_timeouts, self._now, self._claim = FeedbackTimeouts(watches), middleware.now, claim
        self._readiness = StartConditions(self.name, self._feedback_timeouts, middleware, claim, 1.0 / rate, stall)
        self.timing = CycleTiming()
        # made before the first cycle: importing its modules takes a while
        self._dynamics = robot.dynamics if component.dynamics else None
        self._lacks = ""
        self._wait()

    @property
    def feedbacks(self) -> tuple[FeedbackPipe, ...]:
        """Pipes in, in the order of the configuration."""
        return self._feedback_timeouts.feedbacks

    @property
    def name(self) -> str:
        """Name of the plugin's configuration."""
        return self.component.name

    def cycle(self) -> None:
        """Run one control cycle, from reading the feedbacks to publishing the commands; no effect after the end.

        Raises:
            NotFinite: A command of the component is NaN or infinite; nothing was sent on that pipe.
            ClaimRefused: Another plugin commands a joint of this one; nothing was sent.
            ReceiveTimeout: A required feedback did not arrive in time.
            OutOfLimits: The component would start with a joint outside of its limits.
            MiddlewareError: A feedback with `on_timeout: stop` timed out.
        """
        self.transport = 0.0
        self.timing.begin()
        asleep, life = self._readiness.asleep(), self.life
        if asleep and (life is WAITING or life is RUNNING):
            self._awake(asleep)
            life = WAITING
        self.inbox.apply()
        self.timing.done(0)
        if life is STOPPED or life is CLOSED:
            return
        ready = self._ready()
        self.timing.done(1)
        if not ready:
            return
        if life is WAITING or self.component.kinematics:
            self.robot.update()
        if life is WAITING:
            self._start()
        if self._dynamics is not None:
            self._dynamics.update()
        self.timing.done(2)
        self.component.update()
        self.component.send()
        self.timing.done(3)
        if self.component.modify:
            # pipes of links, and plugins that share the Robot, see the State that the component wrote
            self.robot.update()
        self._send()

    def health(self) -> tuple[int, str]:
        """Return the health since the last call: level 0 good, 1 warning, 2 error, and one sentence."""
        level, summary = self._readiness.health(self.life is not WAITING)
        complaint = self.peers.complaint()
        return max(level, int(bool(complaint))), "; ".join(filter(None, (summary or self.life.value, complaint)))

    def figures(self) -> dict[str, float | str]:
        """Return figures for health reports: each feedback, and the command values held back since the start."""
        return {**self._readiness.figures(), **self.outputs.counts()}

    def stop(self) -> None:
        """Bring the robot to rest: the component's own way first, then wheels at zero in any case."""
        self._finish(self._come_to_rest)

    def abort(self) -> None:
        """Stop without calling the component, which has failed: the robot holds."""
        self._finish(self._hold)

    def restart(self) -> None:
        """Continue after `stop` or `abort`: start from the measured state as soon as it is received again."""
        if self.life is STOPPED:
            self._readiness.restart()
            self._wait()

    def blend_in(self, shortest: float) -> None:
        """Set the shortest time in which commands blend in from the measured state at a start [s]."""
        self.outputs.blend.shortest = shortest

    @property
    def running(self) -> bool:
        """Whether its component runs: it has all that it needs."""
        return self.life is RUNNING

    @property
    def released(self) -> bool:
        """Whether the joints were released, and the lower level has confirmed it."""
        return self._claim is None or self._claim.released

    def close(self) -> None:
        """Release the component's resources."""
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
        """Return whether the component can run in this cycle; if not, hold and wait as needed."""
        verdict = self._readiness.look(self.life is RUNNING)
        if verdict is CycleVerdict.WORK:
            return True
        if verdict is CycleVerdict.HOLD:
            self._hold()
            self._readiness.let_go()
        was_running = self.life is RUNNING
        self._wait()
        if was_running:
            self.component.reset()
        return False

    def _awake(self, gap: float) -> None:
        """Hold after the loop stood still for `gap` [s], and drop requests, also those in the inbox."""
        was_running = self.life is RUNNING
        if was_running:
            self._hold()
        self._readiness.awake(gap)
        self._wait()
        if was_running:
            self.component.reset()

    def _wait(self) -> None:
        """Wait for what the plugin lacks, and log it if it has changed."""
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
        except BaseException:
            self._hold()
            raise

    def _hold(self) -> None:
        self.outputs.hold(self._now())

    def _send(self) -> None:
        self.outputs.collect()
        self.timing.done(4)
        stamp = self._now()
        self.outputs.send(stamp)
        self.transport = self._now() - stamp
        self.timing.done(5)

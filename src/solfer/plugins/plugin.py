"""A plugin: one component on one Robot with its pipes, cycle by cycle."""

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from solfer.components import Component
from solfer.config.records.modules import OverloadRecord
from solfer.errors import NotFinite
from solfer.pipes import FeedbackPipe
from solfer.plugins.base_jumps import BaseJumps
from solfer.plugins.component_cycle import ComponentCycle
from solfer.plugins.feedback_timeout import FeedbackTimeout
from solfer.plugins.joint_claim import JointClaim
from solfer.plugins.measured_guard import MeasuredGuard
from solfer.plugins.outputs.outputs import Outputs
from solfer.plugins.peers import Peers
from solfer.plugins.readiness import FORGET, HOLD, WORK, CycleVerdict, Readiness
from solfer.plugins.requests import RequestNotes
from solfer.plugins.timing.cycle_timing import NO_TIMES, CycleTiming, Stage
from solfer.plugins.timing.limits import LOST
from solfer.plugins.timing.overload import Overload
from solfer.plugins.timing.robot_time import RobotTime
from solfer.plugins.tuning import Tuning
from solfer.recording.log import Logger, RunDocuments
from solfer.recording.model import RESET
from solfer.robot import Robot
from solfer.transport import Inbox, Middleware
from solfer.transport.declared import Publications
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport
from solfer.transport.plugin_state import PluginState

logger = logging.getLogger(__name__)


# module globals: the lookup in the control cycle is several times as fast as on the class
STARTING = PluginState.STARTING
RUNNING = PluginState.RUNNING
STOPPED = PluginState.STOPPED
CLOSED = PluginState.CLOSED
CALLS = Stage.CALLS
READ = Stage.READ
ROBOT = Stage.ROBOT
COMPONENT = Stage.COMPONENT
GATE = Stage.GATE
WRITE = Stage.WRITE


@dataclass(frozen=True)
class PluginParts:
    """What a plugin is made of.

    Attributes:
        component: The algorithm.
        robot: The Robot that it works on.
        watches: Pipes in, in the order of the configuration, each with its timeout.
        outputs: Pipes out.
        inbox: Calls from outside.
        rate: Cycles per second [Hz].
        middleware: The clock of the pipes.
        claim: Its claim on the joints that it commands; None: it commands none.
        peers: Supervises the other ends of its pipes; None: they are not supervised.
        stall: Lateness of its own loop at which it begins again [s]; see `Readiness`.
        limits: When its loop is overloaded; None: the defaults.
        jumps: Finds jumps of the base; None: its component has no references in the world.
        guard: Keeps what the component does to its Robot, if it fails, away from others; None: it is not shared.
        publications: What the component declares to publish after its cycles; None: nothing.
        documents: Returns what a recording of it shall have besides numbers.
        requests: Notes what happens, and what others ask of the component; None: it declares nothing.
        tuning: Changes its parameters; None: it has none that are live.
    """

    component: Component
    robot: Robot
    watches: Sequence[FeedbackTimeout]
    outputs: Outputs
    inbox: Inbox
    rate: float
    middleware: Middleware
    claim: JointClaim | None = None
    peers: Peers | None = None
    stall: float | None = None
    limits: OverloadRecord | None = None
    jumps: BaseJumps | None = None
    guard: MeasuredGuard | None = None
    publications: Publications | None = None
    documents: Callable[[], RunDocuments] = RunDocuments
    requests: RequestNotes | None = None
    tuning: Tuning | None = None


class Plugin:
    """One component on one Robot.

    The component starts as soon as every required feedback has arrived and the claim on its joints is granted. When a
    feedback times out that it cannot do without, or the lower level refuses its commands, the plugin holds: wheels at
    zero, positions as they were sent last. After `Component.reset` it starts again from the measured state when it has
    both again. It also starts again

    - when the simulation begins again, without a command in between,
    - when its own loop stood still (a debugger, swap, a suspended laptop): earlier requests may be outdated,
    - when a plugin that follows it starts again.

    Args:
        parts: What it is made of.

    Attributes:
        life: State of the plugin: STARTING, as long as it lacks a required feedback or its claim on joints and sends
            nothing, RUNNING, STOPPED or CLOSED. That of a plugin that is started and stopped is
            `life.managed_plugin.ManagedPlugin.state`.
        peers: See above; the loop calls its `look` about once a second, outside of `cycle`.
        tuning: Changes its live parameters; its loop calls `log` now and then, outside of the cycles.
        timing: Times of the stages of the newest cycle.
        overload: Whether its loop is overloaded.
    """

    def __init__(self, parts: PluginParts):
        component = parts.component
        period = 1.0 / parts.rate
        self.component = component
        self.robot = parts.robot
        self.rate = parts.rate
        self.outputs = parts.outputs
        self.inbox = parts.inbox
        self.documents = parts.documents
        self.requests = parts.requests or RequestNotes()
        self.tuning = parts.tuning or Tuning(component, ())
        component.start_position = parts.outputs.start_position
        if parts.claim is not None:
            parts.claim.note = self.requests.note
        self.peers = parts.peers or Peers(self.name, (), parts.middleware)
        self.life = STARTING
        self._now = parts.middleware.now
        self._readiness = Readiness(
            self.name, parts.watches, parts.claim, middleware=parts.middleware, period=period, stall=parts.stall
        )
        self._readiness.taken = parts.outputs.forget
        refusals = () if parts.claim is None else (parts.claim.refusals,)
        self.inbox.pending = parts.middleware.pending([*self.inbox.queues, *refusals])
        self.timing = CycleTiming()
        self.overload = Overload(self.name, self.feedbacks, period, limits=parts.limits or OverloadRecord())
        self._work = ComponentCycle(
            component,
            RobotTime(self.feedbacks, period, self.overload),
            parts.jumps,
            guard=parts.guard,
            publications=parts.publications,
        )
        self._wait()

    @property
    def feedbacks(self) -> tuple[FeedbackPipe, ...]:
        """Pipes in, in the order of the configuration."""
        return self._readiness.feedbacks.feedbacks

    @property
    def watches(self) -> tuple[FeedbackTimeout, ...]:
        """Pipes in with their timeouts, in the order of the configuration."""
        return self._readiness.feedbacks.timeouts

    @property
    def name(self) -> str:
        """Name of the plugin's configuration."""
        return self.component.name

    @property
    def robot_time(self) -> RobotTime:
        """Time that passes for the component."""
        return self._work.robot_time

    @robot_time.setter
    def robot_time(self, robot_time: RobotTime) -> None:
        self._work.robot_time = robot_time

    def cycle(self) -> None:
        """Run one control cycle, from reading the feedbacks to publishing the commands; no effect after the end.

        Raises:
            NotFinite: A command of the component is NaN or infinite; nothing was sent on that pipe.
            JointFault: A joint does not follow its command; nothing was sent.
            ClaimRefused: Another plugin commands a joint of this one; nothing was sent.
            ReceiveTimeout: A required feedback did not arrive in time.
            OutOfLimits: The component would start with a joint outside of its limits.
            MiddlewareError: A feedback with `on_timeout: stop` timed out.
        """
        timing = self.timing
        now = self._now()
        # each `times[...]` is the time since the one before; a call for it takes a microsecond more in a cold cycle
        times = timing.times
        clock = timing.nanoseconds
        times[:] = NO_TIMES
        mark = clock()
        readiness = self._readiness
        gap = now - readiness.newest
        readiness.newest = now
        if gap > readiness.longest and (self.life is STARTING or self.life is RUNNING):
            readiness.stand_still(gap)
            self.overload.advance(gap)
            self._awake(now)
        inbox = self.inbox
        news = inbox.pending()
        if inbox.waits or (inbox.sources and (inbox.refusal or news)):
            inbox.apply()
        times[CALLS] = -mark + (mark := clock())
        life = self.life
        if life is STOPPED or life is CLOSED:
            return
        complete = readiness.feedbacks.read(now, self.outputs.joints.distance)
        goes_on = complete and life is RUNNING and now >= readiness.earliest
        claim = readiness.claim
        verdict = WORK
        if (
            not goes_on
            or readiness.rewind_words[0] != readiness.rewinds
            or (claim is not None and (news or claim.reason or claim.is_taken))
        ):
            verdict = readiness.decide(now, life is RUNNING)
        times[READ] = -mark + (mark := clock())
        if verdict is not WORK:
            self._obey(verdict, now)
            return
        component = self.component
        work = self._work
        if life is STARTING:
            self.robot.update()
            self._start()
        if component.kinematics or work.dynamics is not None:
            self.robot.update()
        if work.dynamics is not None:
            work.dynamics.update()
        robot_time = work.robot_time
        measured = robot_time.feedback
        passed = robot_time.advance(now, measured.stamp, measured.accepted)
        component.let_pass(passed, robot_time.state[LOST])
        overload = self.overload
        if overload.is_near[0] or overload.reason or overload.pace < 1.0:
            overload.change(passed)
        component.pace = overload.pace
        following = self.outputs.following
        if (
            following is not None
            and life is RUNNING
            and following.watched
            and (fault := following.check(component.time_step))
        ):
            if not self.peers.warning():
                raise fault
            following.start()  # no node receives its commands, which the health says
        if work.jumps is not None and life is RUNNING:
            if move := work.jumps.find(passed):
                component.move_world(move)
        if self.tuning.moves:
            self.tuning.advance(component.time_step)
        times[ROBOT] = -mark + (mark := clock())
        if work.guard is None:
            component.update()
            component.send()
        else:
            work.guard.run(component)
        times[COMPONENT] = -mark + (mark := clock())
        if component.modify:
            # its pipes publish joints that follow others; who reads the State next computes what it needs
            self.robot.follow()
        self.outputs.collect()
        times[GATE] = -mark + (mark := clock())
        self.outputs.send(self._now())
        publications = work.publications
        publications.left -= 1
        if not publications.left:
            publications.run()
        times[WRITE] = -mark + (mark := clock())
        if work.logger is not None:
            work.log(now)

    def measure_with(self, nanoseconds: Callable[[], int], times: memoryview | None = None) -> None:
        """Measure the stages of a cycle with another clock, and into memory of the caller; see `CycleTiming`."""
        self.timing = CycleTiming(nanoseconds, times)

    def start_log(self, logger: Logger) -> None:
        """Let the component declare what it logs; from now on its `log`, if it has one, is called after each `send`."""
        self._work.start_log(logger)

    def health(self) -> tuple[Health, str]:
        """Return the health since the last call, and one sentence."""
        level, summary = self._readiness.health(self.life is not STARTING)
        warning = "; ".join(filter(None, (self.overload.reason, self.peers.warning())))
        sentence = "; ".join(filter(None, (summary or self.life.name.lower(), warning)))
        return max(level, Health.WARNING) if warning else level, sentence

    def pipe_reports(self) -> Iterator[tuple[str, HealthReport]]:
        """Yield the name and the health of each pipe; one thread may call it, also beside the loop."""
        for name, report in self._readiness.reports():
            yield f"{self.name} feedback {name}", report
        for name, report in self.outputs.reports(self.running):
            yield f"{self.name} controller {name}", report

    def figures(self) -> dict[str, float | str]:
        """Return figures for health reports: each feedback, the command values held back, and what was computed.

        What was computed is that of its Robot with all companions of it, since the start of the process.
        """
        computed = {f"computed {name}": count for name, count in self.robot.computations().items()}
        left_out, age, pace = self.overload.figures.tolist()
        load = {"periods left out [%]": 100.0 * left_out, "age of the measurement [ms]": 1e3 * age, "pace": pace}
        return {**self._readiness.figures(), **load, **self._work.figures(), **self.outputs.counts(), **computed}

    def stop(self) -> None:
        """Bring the robot to rest: by the component first, then wheels at zero in any case."""
        self._finish(self._come_to_rest)

    def abort(self) -> None:
        """Stop without calling the component, which has failed: the robot holds."""
        self._finish(self._hold)

    def restart(self) -> None:
        """Continue after `stop` or `abort`: start from the measured state as soon as it is received again."""
        if self.life is STOPPED:
            self.outputs.forget()
            self.overload.restart()
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
        return self._readiness.released

    def close(self) -> None:
        """Release the component's resources."""
        if self.life is not CLOSED:
            self.life = CLOSED
            self.tuning.log()
            self.component.close()

    def _finish(self, rest: Callable[[], None]) -> None:
        """Stop for good; `rest` sends the last commands, if there were any before."""
        if self.life not in (STARTING, RUNNING):
            return
        was_running = self.life is RUNNING
        self.life = STOPPED
        self.inbox.refusal = f"plugin '{self.name}' has stopped"
        self.inbox.apply()
        try:
            if was_running:
                rest()
        finally:
            self._readiness.release()

    def _obey(self, verdict: CycleVerdict, now: float) -> None:
        """Do what a verdict of the time `now` [s] requests."""
        if verdict is HOLD:
            self._hold()
            self._readiness.give_back()
        elif verdict is FORGET:
            self.outputs.forget()
            self._readiness.forget(now)
        self._restart()

    def _awake(self, now: float) -> None:
        """Hold `now` [s], after the loop stood still, and drop messages and requests from before, also in the inbox."""
        if self.life is RUNNING:
            self._hold()
        self._readiness.forget(now)
        self._restart()

    def _restart(self) -> None:
        """Wait for what the plugin lacks, and reset a component that ran."""
        was_running = self.life is RUNNING
        self._wait()
        if was_running:
            self.requests.note(RESET, f"waits {self._readiness.lacks}")
            self.component.reset()

    def _wait(self) -> None:
        """Wait for what the plugin lacks, and log it if it has changed."""
        self.life = STARTING
        if self._readiness.log_wait():
            self.inbox.refusal = f"plugin '{self.name}' waits {self._readiness.lacks}"

    def _start(self) -> None:
        self.outputs.start()
        self.tuning.finish()
        self.component.init()
        self._work.forget_jumps()
        self.life = RUNNING
        self.inbox.refusal = ""
        self._readiness.start()
        self._work.start(self._now())
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

"""Runs plugins one after the other in one thread, in XBotCore's place."""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import monotonic_ns

import numpy as np

from solfer.errors import MiddlewareError
from solfer.plugins.life.budget import BudgetRules, LeakyCounter
from solfer.plugins.life.managed_plugin import ManagedPlugin
from solfer.plugins.life.plugin_set import NOTHING, PluginSet
from solfer.plugins.life.switchboard import Switchboard
from solfer.plugins.plugin import Plugin
from solfer.plugins.timing.cycle_timing import STAGES
from solfer.plugins.timing.overload import REST_RATIO
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.processor import Interruptions
from solfer.telemetry.black_box import BlackBox
from solfer.telemetry.kernel import count_durations
from solfer.telemetry.statistics import EXECUTOR, LoopCount, LoopTime, RuntimeStatistics
from solfer.transport import Middleware
from solfer.transport.fixed_rate import FixedRateLoop
from solfer.transport.lower_level import answered_service
from solfer.transport.middleware import TRIGGER, NoFields
from solfer.transport.plugin_state import FAILED_STATES, SAFE_STOP, PluginState

logger = logging.getLogger(__name__)

# to look a member up in its enumeration would cost time in each cycle
CYCLE, OVERHEAD, LATENESS = LoopTime
CYCLES, SKIPPED, OVERRUNS, UNFORGIVEN, TIME = LoopCount


LONGEST_CYCLE = 1.0 / (1.0 - REST_RATIO)
"""Periods that a cycle may last: a loop of longer ones leaves out so many that motions rest, see `Overload`."""


@dataclass(frozen=True)
class ExecutorRules:
    """Limits of the executor for its plugins.

    Attributes:
        blend: Shortest time in which commands blend in from the measured state at a start [s].
        budget: Fraction of the period that a component may use.
        overruns: Unforgiven cycles beyond `LONGEST_CYCLE`, or beyond a component's budget, at which it is stopped.
        grace: First cycles, of the loop and of each start of a plugin, in which overruns do not count.
    """

    blend: float = 2.0
    budget: float = 0.5
    overruns: int = 20
    grace: int = 100


@dataclass(frozen=True)
class ExecutorTelemetry:
    """What measures and records the cycles of an executor.

    Attributes:
        statistics: Memory of its statistics; None: private memory.
        nanoseconds: Clock for durations [ns]; a virtual one makes every run the same to the bit.
        black_box: Records each cycle; None: nothing is recorded.
        interruptions: Measures how long cycles are kept from running: no overruns; None: they never are.
    """

    statistics: RuntimeStatistics | None = None
    nanoseconds: Callable[[], int] = monotonic_ns
    black_box: BlackBox | None = None
    interruptions: Interruptions | None = None


class Executor:
    """The RT layer: plugins in the order of their list, at one rate.

    Args:
        plugins: The plugins, all at the layer's rate.
        middleware: Clock, and services that switch plugins.
        estop: The emergency stop.
        rules: Its limits.
        telemetry: What measures and records its cycles; None: private statistics.
        polls: Called at the beginning of each cycle: receive calls and replies for the plugins.
        requires: See `PluginSet`.

    Attributes:
        statistics: Its statistics.
        beside: Called by `run` ten times a second, when a cycle is done.

    Raises:
        MiddlewareError: There is no plugin, two have one name, or their rates differ.
    """

    def __init__(
        self,
        plugins: Sequence[Plugin],
        middleware: Middleware,
        estop: EmergencyStopLatch,
        rules: ExecutorRules | None = None,
        telemetry: ExecutorTelemetry | None = None,
        *,
        polls: Sequence[Callable[[], None]] = (),
        requires: Mapping[str, Sequence[str]] = NOTHING,
    ):
        telemetry = telemetry or ExecutorTelemetry()
        self._rules = rules = rules or ExecutorRules()
        self.beside: Callable[[], None] = lambda: None
        self._ns = telemetry.nanoseconds
        self._middleware = middleware
        self.estop = estop
        self.statistics = telemetry.statistics or RuntimeStatistics(
            plugins[0].rate if plugins else 0.0, [plugin.name for plugin in plugins], STAGES
        )
        # one array for all durations of a cycle, in the rows of the statistics
        self._durations = np.zeros(len(self.statistics.histograms), dtype=np.int64)
        budget = BudgetRules(rules.budget, rules.overruns, rules.grace)
        self._interruptions = telemetry.interruptions
        self._was_interrupted = False
        self._set = PluginSet(
            plugins,
            budget,
            rules.blend,
            polls=polls,
            admit=self._admit,
            requires=requires,
        )
        self._set.measure(telemetry.nanoseconds, self._durations[len(LoopTime) :])
        self._set.interrupted = self._interrupted
        self._beside_cycles = max(1, round(0.1 * self.rate))  # from one call of `beside` to the next
        self._period = round(1e9 / self.rate)
        self._longest = round(LONGEST_CYCLE * self._period)
        self._long = LeakyCounter(rules.overruns)
        self._black_box = telemetry.black_box
        self._set.changed = self._note
        self._set.initialize()
        self._serve()

    @property
    def plugins(self) -> tuple[ManagedPlugin, ...]:
        """The plugins with their lives."""
        return self._set.plugins

    @property
    def switchboard(self) -> Switchboard:
        """Starts and stops the plugins."""
        return self._set.switchboard

    @property
    def rate(self) -> float:
        """Cycles per second [Hz]."""
        return self._set.rate

    def cycle(self, late: int = 0) -> None:
        """Run one cycle, which began `late` after its deadline [ns]. Errors of plugins are not raised."""
        statistics = self.statistics
        begin = self._ns()
        if self._interruptions is not None:
            self._interruptions.start()
        if self.estop:
            self._set.abort(f"emergency stop: {self.estop.reason}")
            self._answer_stop()
        components = self._set.cycle()
        end = self._ns()
        if self._black_box is not None:
            self._black_box.record(end, late, end - begin)
            end = self._ns()
        durations = self._durations
        counts = statistics.counts
        durations[CYCLE], durations[OVERHEAD], durations[LATENESS] = end - begin, end - begin - components, late
        count_durations(statistics.histograms, durations, len(LoopTime))
        self._check_overrun(late, end - begin)
        counts[CYCLES] = self._set.cycles
        counts[TIME] = end
        statistics.beat(monotonic_ns())

    def run(self, running: Callable[[], bool] | None = None) -> None:
        """Cycle while `running` (default: until the middleware ends), then stop and close all plugins.

        Deadlines are absolute. A loop that is late skips whole periods and never makes up for them.
        """
        try:
            FixedRateLoop(self._middleware, self.rate).run(self._run_cycle, running or self._middleware.running)
        finally:
            self.close()

    def close(self) -> None:
        """Stop and close all plugins."""
        self._set.close()

    def clear(self) -> None:
        """Release the emergency stop; no plugin starts by itself.

        Raises:
            MiddlewareError: A plugin is not at rest.
        """
        moving = [managed.name for managed in self.plugins if not managed.at_rest]
        if moving:
            raise MiddlewareError(
                f"the emergency stop stays: {', '.join(moving)} not at rest", expected="all plugins stopped or aborted"
            )
        self.estop.clear()

    def _serve(self) -> None:
        """Offer the services of the layer, which run between two cycles."""
        submit = self._set.inbox.submit
        self.switchboard.serve(self._middleware, EXECUTOR, submit)
        self._middleware.serve(
            EXECUTOR,
            [
                answered_service("estop", TRIGGER, NoFields, work=lambda _: self.estop.trip("by service")),
                answered_service("estop_clear", TRIGGER, NoFields, work=lambda _: self.clear()),
            ],
            submit,
        )

    def _answer_stop(self) -> None:
        """Confirm the emergency stop; `solfer rt estop` waits for that, and reads nothing else."""
        faults = [each for each in self.plugins if each.state is PluginState.FAULT]
        if faults:
            self.estop.answer(f"'{faults[0].name}' cannot hold: {faults[0].reason}", holds=False)
        else:
            self.estop.answer(f"{', '.join(each.name for each in self.plugins)} at rest")

    def _admit(self) -> None:
        """Let no plugin start while the emergency stop is tripped."""
        if self.estop:
            raise MiddlewareError(
                f"the emergency stop is tripped: {self.estop.reason}",
                expected=f"`{self.estop.cure}`, or the service {EXECUTOR}/estop_clear, first",
            )

    def _run_cycle(self, late: float, skipped: int) -> None:
        """Run a cycle, which begins `late` [s] after its deadline, or after the first one of the `skipped` periods."""
        lateness = max(0, int(1e9 * late))
        overhang = self._overhang()
        if skipped:
            self._skip(skipped, lateness - overhang)
        # what the cycle before took too long was counted with that
        self.cycle(lateness - min(skipped, overhang // self._period) * self._period)
        if self._set.cycles % self._beside_cycles == 0:
            for index, managed in enumerate(self.plugins):
                self.statistics.put_computed(index, managed.plugin.robot.computations())
                managed.plugin.tuning.log()
            self.beside()

    def _overhang(self) -> int:
        """Compute how much longer the newest cycle lasted than to the next deadline [ns]."""
        durations = self._durations
        period = self._period
        return max(0, int(durations[LATENESS]) % period + int(durations[CYCLE]) - period)

    def _skip(self, periods: int, late: int) -> None:
        """Count skipped periods for their cause, the longest of the last stages and a wake-up that was `late` [ns]."""
        statistics = self.statistics
        longest = late
        row = int(LATENESS)
        for index, times in enumerate(self._set.times):
            for stage, time in enumerate(times):
                if time > longest:
                    longest = time
                    row = statistics.row(index, stage)
        statistics.counts[SKIPPED] += periods
        statistics.skips[row] += periods

    def _interrupted(self) -> int:
        """Return how long this cycle was kept from running [ns]."""
        return 0 if self._interruptions is None else self._interruptions.in_cycle()

    def _check_overrun(self, delay: int, lasted: int) -> None:
        """Count a cycle that began `delay` after its deadline and lasted so long [ns]; too many long ones abort all.

        Neither one that was kept from running counts, nor how late the next one is for that: that is an overload.
        """
        counts = self.statistics.counts
        taken = lasted if self._was_interrupted else delay + lasted
        self._was_interrupted = taken > self._period >= taken - self._interrupted()
        if self._was_interrupted or self._set.cycles <= self._rules.grace:
            return
        counts[OVERRUNS] += taken > self._period
        is_long = lasted > self._longest and lasted - self._interrupted() > self._longest
        often = self._long.add(is_long)
        counts[UNFORGIVEN] = self._long.count
        if not often:
            return
        self._long.reset()
        times = [sum(each) for each in self._set.times]
        slowest = times.index(max(times))
        reason = (
            f"{SAFE_STOP}: {self._rules.overruns} cycles of more than {LONGEST_CYCLE:g} periods, the newest "
            f"{1e-6 * lasted:.3f} ms of {1e-6 * self._period:.3f} ms; the slowest is "
            f"'{self.plugins[slowest].name}' with {1e-6 * times[slowest]:.3f} ms"
        )
        logger.error("%s", reason)
        self._set.abort(reason)

    def _note(self, index: int, managed: ManagedPlugin) -> None:
        """Publish a plugin's new state, and log why it is aborted."""
        state = managed.state
        budget = self._set.budgets[index]
        if state in FAILED_STATES:
            logger.error(
                "%s is aborted: %s",
                managed.name,
                managed.reason,
                exc_info=managed.failure if state is PluginState.FAULT else None,
            )
        over = budget.overruns.total if budget is not None else 0
        self.statistics.put_life(index, state, managed.starts, managed.aborts, over)
        self.statistics.put_text(managed.reason, index)
        if self._black_box is not None:
            self._black_box.note(index, managed, self._ns())

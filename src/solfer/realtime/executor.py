"""Runs plugins one after the other in one thread, in XBotCore's place."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from time import monotonic_ns

import numpy as np

from solfer.errors import MiddlewareError
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.lifecycle import Cyclic, ManagedPlugin, PluginState
from solfer.realtime.switchboard import Switchboard
from solfer.realtime.telemetry.black_box import BlackBox
from solfer.realtime.telemetry.count_durations import count_durations
from solfer.realtime.telemetry.histograms import LeakyCounter
from solfer.realtime.telemetry.statistics_memory import LOOP, RuntimeStatistics
from solfer.transport import Inbox, Middleware

logger = logging.getLogger(__name__)

COMPONENT = "component"
"""The stage of a plugin's cycle in which its component runs."""

SELDOM = 0.1
"""Time between two calls of `beside` [s]."""

CYCLE, OVERHEAD, LATENESS = range(len(LOOP))


@dataclass(frozen=True)
class ExecutorRules:
    """Limits of the executor for its plugins.

    Attributes:
        blend: Shortest time in which commands blend in from the measured state at a start [s].
        budget: Share of the period that a component may use.
        overruns: Unforgiven overruns, of the loop or of a component's budget, at which it is stopped.
        grace: First cycles, of the loop and of each start of a plugin, in which overruns do not count.
    """

    blend: float = 2.0
    budget: float = 0.5
    overruns: int = 20
    grace: int = 100


class Executor:
    """The RT layer: plugins in the order of their list, at one rate.

    Args:
        plugins: The plugins, all at the layer's rate.
        middleware: Clock, and services that switch plugins.
        estop: The emergency stop.
        statistics: Memory of its statistics; None: private memory.
        rules: Its limits.
        nanoseconds: Clock for durations [ns]; a virtual one makes every run the same to the bit.
        polls: Called at the beginning of each cycle: receive calls and replies for the plugins.
        black_box: Records each cycle; None: nothing is recorded.
        beside: Called by `run` ten times a second, when a cycle is done.

    Attributes:
        statistics: Its statistics.
        switchboard: Starts and stops the plugins.

    Raises:
        MiddlewareError: There is no plugin, two have one name, or their rates differ.
    """

    def __init__(
        self,
        plugins: Sequence[Cyclic],
        middleware: Middleware,
        estop: EmergencyStopLatch,
        statistics: RuntimeStatistics | None = None,
        rules: ExecutorRules | None = None,
        nanoseconds: Callable[[], int] = monotonic_ns,
        polls: Sequence[Callable[[], None]] = (),
        black_box: BlackBox | None = None,
        beside: Callable[[], None] = lambda: None,
    ):
        _check(plugins)
        self._beside, self._seldom = beside, max(1, round(SELDOM * plugins[0].rate))
        self._rules, self._ns, self._middleware, self.estop = rules or ExecutorRules(), nanoseconds, middleware, estop
        self.rate = plugins[0].rate
        self._period = round(1e9 / self.rate)
        self.plugins = tuple(ManagedPlugin(plugin, self._rules.blend) for plugin in plugins)
        stages = plugins[0].timing.names
        self.statistics = statistics or RuntimeStatistics(self.rate, [plugin.name for plugin in plugins], stages)
        self._component, self._times = stages.index(COMPONENT), self._collect(plugins)
        self._budget = int(self._rules.budget * self._period)
        self._over = [LeakyCounter(self._rules.overruns) for _ in plugins]
        self._since = [0] * len(plugins)  # cycle in which a plugin began to run
        self._late = LeakyCounter(self._rules.overruns)
        self._cycles, self._polls, self._black_box = 0, tuple(polls), black_box
        self.inbox, self.switchboard = Inbox(), Switchboard(self.plugins, estop)
        for index, (plugin, managed) in enumerate(zip(plugins, self.plugins, strict=True)):
            plugin.timing.nanoseconds = nanoseconds
            managed.changed = partial(self._note, index)
            managed.initialize()
        self.switchboard.serve(middleware, self.inbox.submit)

    def cycle(self, late: int = 0) -> None:
        """Run one cycle, which began `late` after its deadline [ns]. Errors of plugins are not raised."""
        statistics, begin = self.statistics, self._ns()
        if self.estop:
            self._obey()
        for poll in self._polls:
            poll()
        self.inbox.apply()
        components = 0
        for index, managed in enumerate(self.plugins):
            managed.cycle()
            took = self._times[index][self._component]
            components += took
            if took > self._budget or self._over[index].count:
                self._check_budget(index, managed, took)
        end = self._ns()
        if self._black_box is not None:
            self._black_box.record(end, late, end - begin)
            end = self._ns()
        self._cycles += 1
        durations, counts = self._durations, statistics.counts
        durations[CYCLE], durations[OVERHEAD], durations[LATENESS] = end - begin, end - begin - components, late
        count_durations(statistics.histograms.rows, durations, len(LOOP))
        self._check_overrun(late + end - begin)
        counts[0], counts[4] = self._cycles, end
        statistics.beat(monotonic_ns())

    def run(self, running: Callable[[], bool] | None = None) -> None:
        """Cycle while `running` (default: until the middleware ends), then stop and close all plugins.

        Deadlines are absolute. A loop that is late skips whole periods and never makes up for them.
        """
        middleware, period, turn = self._middleware, self._period, 0
        begin, running = middleware.now(), running or middleware.running
        try:
            while running():
                late = max(0, int(1e9 * (middleware.now() - begin)) - turn * period)
                self.cycle(late)
                turn += 1
                behind = (int(1e9 * (middleware.now() - begin)) - turn * period) // period
                if behind > 0:
                    self._skip(behind, late)
                    turn += behind
                if self._cycles % self._seldom == 0:
                    self._beside()
                middleware.sleep_until(begin + 1e-9 * turn * period)
        finally:
            self.close()

    def close(self) -> None:
        """Stop and close all plugins."""
        for managed in self.plugins:
            managed.close()

    def _collect(self, plugins: Sequence[Cyclic]) -> list[memoryview]:
        """Make one array for all durations of a cycle, in the statistics' rows; return the part of each plugin [ns]."""
        self._durations = np.zeros(len(self.statistics.histograms.rows), dtype=np.int64)
        words = memoryview(self._durations).cast("B").cast("q")
        for index, plugin in enumerate(plugins):
            first = self.statistics.row(index, 0)
            plugin.timing.times = words[first : first + len(plugin.timing.names)]
        return [plugin.timing.times for plugin in plugins]

    def _skip(self, periods: int, late: int) -> None:
        """Count skipped periods for their cause, the longest of all stages and the wake-up, which was `late` [ns]."""
        statistics, longest, row = self.statistics, late, LATENESS
        for index, times in enumerate(self._times):
            for stage, time in enumerate(times):
                if time > longest:
                    longest, row = time, statistics.row(index, stage)
        statistics.counts[1] += periods
        statistics.skips[row] += periods

    def _obey(self) -> None:
        """Abort all plugins, since the emergency stop is tripped."""
        for managed in self.plugins:
            if managed.active:
                managed.abort(f"emergency stop: {self.estop.reason}")
        self.estop.answer()

    def _check_budget(self, index: int, managed: ManagedPlugin, took: int) -> None:
        """Abort a plugin if its component, which `took` so long [ns], is over its budget too often."""
        if not managed.active or self._cycles < self._since[index] + self._rules.grace:
            return
        counter, slow = self._over[index], took > self._budget
        often = counter.add(slow)
        if not slow:
            return
        self._note(index, managed)
        if often:
            counter.reset()
            managed.abort(
                f"its component took {1e-6 * took:.3f} ms, and more than its budget of "
                f"{1e-6 * self._budget:.3f} ms too often"
            )

    def _check_overrun(self, taken: int) -> None:
        """Count a cycle that ended `taken` after its deadline [ns]; too many late ones abort all plugins."""
        counts, late = self.statistics.counts, self._late
        if self._cycles <= self._rules.grace:
            return
        often = late.add(taken > self._period)
        counts[2], counts[3] = late.total, late.count
        if not often:
            return
        late.reset()
        slowest = max(range(len(self.plugins)), key=lambda index: sum(self._times[index]))
        reason = (
            f"safe stop: {self._rules.overruns} cycles too long, the newest {1e-6 * taken:.3f} ms of "
            f"{1e-6 * self._period:.3f} ms; the slowest is '{self.plugins[slowest].name}' with "
            f"{1e-6 * sum(self._times[slowest]):.3f} ms"
        )
        logger.error("%s", reason)
        for managed in self.plugins:
            if managed.active:
                managed.abort(reason)

    def _note(self, index: int, managed: ManagedPlugin) -> None:
        """Publish a plugin's new state."""
        if managed.state is PluginState.STARTING and not managed.plugin.running:
            self._since[index] = self._cycles
            self._over[index].reset()
        self.statistics.put_life(index, managed.state, managed.starts, managed.aborts, self._over[index].total)
        self.statistics.put_text(managed.reason, index)
        if self._black_box is not None:
            self._black_box.stages[index] = managed.state


def _check(plugins: Sequence[Cyclic]) -> None:
    if not plugins:
        raise MiddlewareError("an RT layer without plugins", expected="at least one")
    names = [plugin.name for plugin in plugins]
    for name in names:
        if names.count(name) > 1:
            raise MiddlewareError(f"the plugin '{name}' is listed {names.count(name)} times", expected="each once")
    for plugin in plugins:
        if plugin.rate != plugins[0].rate:
            raise MiddlewareError(
                f"'{plugin.name}' at {plugin.rate:g} Hz in an RT layer of {plugins[0].rate:g} Hz",
                expected="one rate for all plugins of a layer",
            )

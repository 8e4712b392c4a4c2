"""The control loop of a process: one plugin or several, and statistics of how well they kept their deadlines."""

import gc
import logging
import os
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from time import monotonic_ns
from typing import Any, Protocol

import numpy as np

from solfer.errors import ClaimRefused, ComponentError, OutOfLimits, ReceiveTimeout, located
from solfer.plugins.life.budget import BudgetRules
from solfer.plugins.life.managed_plugin import ManagedPlugin
from solfer.plugins.life.plugin_set import NOTHING, PluginSet
from solfer.plugins.plugin import Plugin
from solfer.plugins.timing.cycle_timing import Stage
from solfer.throttle import Throttle
from solfer.transport import Middleware
from solfer.transport.fixed_rate import FixedRateLoop
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport
from solfer.transport.plugin_state import FAILED_STATES, PluginState

logger = logging.getLogger(__name__)

REPORT_PERIOD = 1.0
"""Time between two health reports [s]."""

WRITE = Stage.WRITE
STOPPING = PluginState.STOPPING


class CycleRecorder(Protocol):
    """A recorder of the cycles of a loop."""

    def record(self, time: int, late: int, took: int) -> None:
        """Record a cycle that ends at `time`, began `late` after its deadline and `took` so long [ns]."""

    def note(self, index: int, managed: ManagedPlugin, time: int) -> None:
        """Record a plugin's new state or reason at `time` [ns]."""


class LoopStatistics:
    """Cost of the last cycles, their transport apart, and their lateness, in fixed memory.

    Args:
        size: Number of cycles that are remembered.

    Attributes:
        cycles: Cycles since the start.
        skipped: Periods that were skipped because the loop was late by more than one.
    """

    def __init__(self, size: int = 2048):
        self.cycles = self.skipped = 0
        self._times = np.zeros((3, size))
        self._rows: list[Any] = [memoryview(row) for row in self._times]  # they take a number in a tenth of the time

    def add(self, times: memoryview, late: float, skipped: int) -> None:
        """Add a cycle: `times` of its stages [ns], how `late` it started [s], and the periods `skipped` before it."""
        transport, (costs, transports, delays) = times[WRITE], self._rows
        place = self.cycles % len(costs)
        costs[place], transports[place], delays[place] = 1e-9 * (sum(times) - transport), 1e-9 * transport, late
        self.cycles += 1
        self.skipped += skipped

    def summary(self) -> dict[str, float]:
        """Return the figures for reports: times in milliseconds."""
        if not self.cycles:
            return {"cycles": 0}
        cost, transport, late = 1e3 * self._times[:, : self.cycles]
        return {
            "cycles": self.cycles,
            "skipped periods": self.skipped,
            "cycle median [ms]": float(np.median(cost)),
            "cycle p99 [ms]": float(np.percentile(cost, 99)),
            "cycle max [ms]": float(cost.max()),
            "transport median [ms]": float(np.median(transport)),
            "late p99 [ms]": float(np.percentile(late, 99)),
            "late max [ms]": float(late.max()),
        }


def run(
    plugins: Plugin | Sequence[Plugin],
    middleware: Middleware,
    budget: BudgetRules | None = None,
    polls: Sequence[Callable[[], None]] = (),
    requires: Mapping[str, Sequence[str]] = NOTHING,
    *,
    recorder: CycleRecorder | None = None,
) -> LoopStatistics:
    """Run a plugin, or several one after the other, until the middleware ends; then stop and close them.

    A loop that is late, because of a long cycle or because it was woken late, skips whole periods and never bursts:
    each cycle starts in a period of its own.

    A plugin that fails holds. The process ends when the only one has failed. Several are switched by the services of
    `Switchboard`, offered as `<name of the node>/<service>`: one that fails is aborted, and the others go on, until all
    have failed.

    Args:
        plugins: The plugins, in their order in a cycle.
        middleware: Their clock.
        budget: How long their components may take; None: as long as they like.
        polls: Called at the beginning of each cycle, such as `Sharing.turns.next`.
        requires: See `PluginSet`.
        recorder: Records each cycle; None: nothing is recorded.

    Returns:
        The statistics of the first plugin.

    Raises:
        ComponentError: The component failed, the first one where there are several; the robot was brought to rest
            before.
        ClaimRefused: Another plugin commands a joint of this one, which has sent nothing since its request; or two of
            the plugins command the same joint, and none has sent anything.
        ReceiveTimeout: A required feedback did not arrive in time.
        OutOfLimits: The plugin would have started with a joint outside of its limits; it has commanded nothing since.
        MiddlewareError: There is no plugin, two have one name, or their rates differ.
    """
    loop = PluginLoop(
        PluginSet(plugins if isinstance(plugins, Sequence) else [plugins], budget, polls=polls, requires=requires),
        middleware,
        recorder,
    )
    gc.collect()
    gc.freeze()
    try:
        loop.run()
    finally:
        gc.unfreeze()
    return loop.statistics[0]


class PluginLoop:
    """Runs the plugins of a set at their rate, and reports their health.

    Args:
        plugins: The plugins.
        middleware: Their clock.
        recorder: Records each cycle; None: nothing is recorded.

    Attributes:
        plugins: See above.
        statistics: Statistics of each plugin.
    """

    def __init__(self, plugins: PluginSet, middleware: Middleware, recorder: CycleRecorder | None = None):
        self.plugins = plugins
        self._middleware = middleware
        self._recorder = recorder
        self.statistics = tuple(LoopStatistics() for _ in plugins.plugins)
        self._seen = [managed.plugin.life for managed in plugins.plugins]
        self._next_report = 0.0
        self._late = Throttle(logger)
        self._reports: deque[tuple[str, HealthReport]] = deque()
        self._skipped = 0
        plugins.changed = self._note
        if len(plugins.plugins) > 1:
            plugins.switchboard.serve(middleware, middleware.name.rpartition("/")[2], plugins.inbox.submit)

    def run(self) -> None:
        """Run until the middleware ends, or all plugins have failed; then stop and close them. See `loop.run`."""
        plugins = self.plugins
        middleware = self._middleware
        failure: BaseException | None = None
        try:
            plugins.start()
            loop = FixedRateLoop(middleware, plugins.rate)
            self._next_report = middleware.now() + REPORT_PERIOD
            loop.run(self._cycle, lambda: plugins.failure is None and middleware.running())
        except BaseException as error:  # a regular end goes through `middleware.running`: what is raised is a failure
            failure = error
            plugins.abort(located(error), error)
        failure = failure or plugins.failure
        before = set(plugins.failures)
        plugins.close()
        late = [error for name, error in plugins.failures.items() if name not in before]
        if failure is not None or late:
            self._fail(failure or late[0])
        for managed, statistics in zip(plugins.plugins, self.statistics, strict=True):
            if managed.name not in plugins.failures:
                logger.info("%s has ended in good order after %d cycles", managed.name, statistics.cycles)

    def _cycle(self, late: float, skipped: int) -> None:
        """Run one cycle, which begins `late` [s] after its deadline, or after those of the `skipped` periods."""
        plugins = self.plugins
        delay = skipped / plugins.rate
        if delay >= 0.02:  # [s] shorter ones, frequent on a shared machine, are only counted
            names = ", ".join(managed.name for managed in plugins.plugins)
            self._late.warning("late", "%s is %.0f ms late", names, 1e3 * delay)
        begin = monotonic_ns()
        plugins.cycle()
        now = self._middleware.now()
        if self._recorder is not None:
            self._recorder.record(round(1e9 * now), round(1e9 * late), monotonic_ns() - begin)
        due = now >= self._next_report
        if due:
            self._next_report = now + REPORT_PERIOD
        for index, managed in enumerate(plugins.plugins):
            self.statistics[index].add(plugins.times[index], late, skipped)
            if due or managed.plugin.life is not self._seen[index]:
                self._report(index, managed)
        if due:
            self._collect()
        elif self._reports:  # one in a cycle: to publish it takes a while
            name, report = self._reports.popleft()
            self._middleware.report(name, report.level, report.summary, report.values)

    def _report(self, index: int, managed: ManagedPlugin) -> None:
        plugin = managed.plugin
        self._seen[index] = managed.plugin.life
        plugin.peers.look()
        plugin.tuning.log()
        values = {**self.statistics[index].summary(), **plugin.figures()}
        self._middleware.report(plugin.name, *managed.health(), values)

    def _collect(self) -> None:
        """Note the health of the process, and of the pipes of each plugin, to report it in the next cycles."""
        statistics = self.statistics[0]
        news = statistics.skipped - self._skipped
        self._skipped = statistics.skipped
        level, summary = (Health.WARNING, f"{news} periods skipped") if news else (Health.GOOD, "in time")
        process = f"{self._middleware.name.rpartition('/')[2]} process"
        self._reports.clear()
        self._reports.append((process, HealthReport(level, summary, {"process": os.getpid(), **statistics.summary()})))
        for managed in self.plugins.plugins:
            self._reports.extend(managed.plugin.pipe_reports())

    def _note(self, index: int, managed: ManagedPlugin) -> None:
        """Log a plugin that fails while others go on, or that stops since it requires one of these."""
        if self._recorder is not None:
            self._recorder.note(index, managed, round(1e9 * self._middleware.now()))
        if managed.state in FAILED_STATES and self.plugins.failure is None:
            logger.error("%s is aborted: %s", managed.name, managed.reason)
        elif managed.state is STOPPING and managed.reason:
            logger.error("%s stops: %s", managed.name, managed.reason)

    def _fail(self, failure: BaseException) -> None:
        if isinstance(failure, ClaimRefused | ReceiveTimeout | OutOfLimits):
            raise failure
        names = "', '".join(managed.name for managed in self.plugins.plugins)
        subject = f"plugins '{names}'" if len(self.plugins.plugins) > 1 else f"plugin '{names}'"
        error = ComponentError(f"{subject} failed, the robot holds: {located(failure, lines=True)}")
        error.exit_code = 1
        raise error from failure

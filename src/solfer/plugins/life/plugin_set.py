"""Several plugins in one loop."""

import logging
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from time import monotonic_ns

import numpy as np

from solfer.errors import MiddlewareError, located
from solfer.plugins.life.budget import Budget, BudgetRules
from solfer.plugins.life.managed_plugin import ManagedPlugin
from solfer.plugins.life.switchboard import Switchboard
from solfer.plugins.plugin import Plugin
from solfer.plugins.timing.cycle_timing import STAGES, Stage
from solfer.transport import Inbox
from solfer.transport.plugin_state import FAILED_STATES, PluginState

logger = logging.getLogger(__name__)

COMPONENT = Stage.COMPONENT
RUNNING = PluginState.RUNNING

NOTHING: Mapping[str, Sequence[str]] = {}


class PluginSet:
    """Runs plugins one after the other, in the order of their list, within one loop that belongs to the caller.

    Each plugin has a life of its own (`ManagedPlugin`): it is started, stopped and aborted between two cycles
    (`switchboard`), and one that raises, or whose component exceeds its budget too often, is aborted and holds while
    the others go on.

    Args:
        plugins: The plugins, all at one rate.
        budget: How long their components may take; None: as long as they like.
        blend: Shortest time in which commands blend in at a start [s]; None: that of each plugin.
        nanoseconds: Clock for durations [ns]; a virtual one makes every run the same to the bit.
        polls: Called at the beginning of each cycle: receive calls and replies, `Sharing.turns.next`.
        admit: Raises a MiddlewareError while no plugin may start.
        requires: Names of the others that a plugin needs, by its own name: where one of them ends, it stops with it.

    Attributes:
        plugins: The plugins with their lives.
        rate: Cycles per second [Hz].
        times: The times of the stages of each plugin in the newest cycle [ns].
        switchboard: Starts and stops the plugins.
        inbox: Calls for the loop, carried out at the beginning of a cycle.
        cycles: Cycles since the start.
        failures: What ended the runs of plugins that have failed and were not started again, the first one first.
        changed: Called after each change of a plugin's state or reason, and each overrun, with its index.
        interrupted: Measures how long this cycle was kept from running [ns], which counts in no budget.

    Raises:
        MiddlewareError: There is no plugin, two have one name, or their rates differ.
    """

    _ENDED = (PluginState.STOPPING, PluginState.STOPPED, PluginState.CLOSED, *FAILED_STATES)
    """States of a plugin that others cannot rely on."""

    def __init__(
        self,
        plugins: Sequence[Plugin],
        budget: BudgetRules | None = None,
        blend: float | None = None,
        nanoseconds: Callable[[], int] = monotonic_ns,
        polls: Sequence[Callable[[], None]] = (),
        *,
        admit: Callable[[], None] = lambda: None,
        requires: Mapping[str, Sequence[str]] = NOTHING,
    ):
        _check(plugins)
        self.rate = plugins[0].rate
        self.cycles = 0
        self._polls = tuple(polls)
        period = round(1e9 / self.rate)
        self.plugins = tuple(ManagedPlugin(plugin, blend) for plugin in plugins)
        self.budgets = tuple(Budget(budget, period) if budget is not None else None for _ in plugins)
        self.measure(nanoseconds, np.zeros(len(plugins) * len(STAGES), dtype=np.int64))
        self.inbox = Inbox()
        self.switchboard = Switchboard(self.plugins, admit)
        self.changed: Callable[[int, ManagedPlugin], None] = lambda index, managed: None
        self.interrupted: Callable[[], int] = lambda: 0
        self.failures: dict[str, BaseException] = {}
        self._needed_by = {
            each.name: tuple(other for other in self.plugins if each.name in requires.get(other.name, ()))
            for each in self.plugins
        }
        for index, managed in enumerate(self.plugins):
            managed.changed = partial(self._note, index)

    def measure(self, nanoseconds: Callable[[], int], durations: np.ndarray) -> None:
        """Write the durations of the stages of a cycle, by a clock [ns], to int64 of shape (plugins * stages,) [ns]."""
        self.times = _measure([managed.plugin for managed in self.plugins], nanoseconds, durations)
        self._rows = tuple(zip(self.plugins, self.times, self.budgets, strict=True))

    @property
    def failure(self) -> BaseException | None:
        """What the first plugin failed with, when all have failed; None: one works, waits, or was stopped in order."""
        return next(iter(self.failures.values())) if len(self.failures) == len(self.plugins) else None

    def initialize(self) -> None:
        """Admit all plugins; each waits for its start and sends nothing."""
        for managed in self.plugins:
            managed.initialize()

    def start(self) -> None:
        """Start all plugins.

        Raises:
            ClaimRefused: Two of them would command the same joint; none is started.
        """
        self.switchboard.commit(self.switchboard.plan([managed.name for managed in self.plugins]))

    def cycle(self) -> int:
        """Run one cycle of each plugin; returns the time of all components [ns]. Errors of plugins are not raised."""
        for poll in self._polls:
            poll()
        if self.inbox.waits:
            self.inbox.apply()
        components = 0
        for managed, times, budget in self._rows:
            if managed.state is RUNNING:  # mostly: without a call in between
                plugin = managed.plugin
                try:
                    plugin.cycle()
                except BaseException as error:
                    managed.abort(located(error), error)
                else:
                    if plugin.life is not RUNNING or managed.reason != plugin.overload.reason:
                        managed.follow()
            else:
                managed.cycle()
            took = times[COMPONENT]
            components += took
            if budget is not None and (took > budget.limit or budget.overruns.count):
                self._charge(managed, budget, took)
        self.cycles += 1
        return components

    def abort(self, reason: str, failure: BaseException | None = None) -> None:
        """Abort all plugins that are active; see `ManagedPlugin.abort`."""
        for managed in self.plugins:
            if managed.active:
                managed.abort(reason, failure)

    def close(self) -> None:
        """Stop and close all plugins."""
        for managed in self.plugins:
            managed.close()

    def _charge(self, managed: ManagedPlugin, budget: Budget, took: int) -> None:
        """Count a cycle in which a component `took` so long [ns]; abort its plugin if it is too slow too often."""
        if not managed.active or (took > budget.limit >= took - self.interrupted()):
            return
        before = budget.overruns.total
        often = budget.exceeded(took, self.cycles)
        if budget.overruns.total != before:
            managed.changed(managed)
        if often:
            managed.too_slow(budget.explanation(took))

    def _note(self, index: int, managed: ManagedPlugin) -> None:
        """Follow a change of a plugin."""
        budget = self.budgets[index]
        if budget is not None and managed.state is PluginState.STARTING and not managed.plugin.running:
            budget.restart(self.cycles)
        if managed.failure is None:
            self.failures.pop(managed.name, None)
        else:
            self.failures.setdefault(managed.name, managed.failure)
        self.changed(index, managed)
        if managed.state in self._ENDED:
            for other in self._needed_by[managed.name]:
                if other.active:
                    other.stop(f"it requires '{managed.name}', which is {managed.state.name.lower()}")


def _measure(plugins: Sequence[Plugin], nanoseconds: Callable[[], int], times: np.ndarray) -> tuple[memoryview, ...]:
    """Let each plugin measure its stages in its part of `times`; return these parts."""
    words = memoryview(times).cast("B").cast("q")
    stages = len(STAGES)
    parts = tuple(words[index * stages : (index + 1) * stages] for index in range(len(plugins)))
    for plugin, part in zip(plugins, parts, strict=True):
        plugin.measure_with(nanoseconds, part)
    return parts


def _check(plugins: Sequence[Plugin]) -> None:
    if not plugins:
        raise MiddlewareError("a loop without plugins", expected="at least one")
    names = [plugin.name for plugin in plugins]
    for name in names:
        if names.count(name) > 1:
            raise MiddlewareError(f"the plugin '{name}' is listed {names.count(name)} times", expected="each once")
    for plugin in plugins:
        if plugin.rate != plugins[0].rate:
            raise MiddlewareError(
                f"'{plugin.name}' at {plugin.rate:g} Hz in a loop of {plugins[0].rate:g} Hz",
                expected="one rate for all plugins of a loop",
            )

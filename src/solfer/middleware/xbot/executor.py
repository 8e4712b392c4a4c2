"""Runs plugins one after the other in one thread, in XBotCore's place."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import monotonic_ns

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.black_box import BlackBox
from solfer.middleware.xbot.board import LOOP, Board
from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.lifecycle import Cyclic, Managed, Stage
from solfer.middleware.xbot.switchboard import Switchboard
from solfer.middleware.xbot.tally import tally
from solfer.middleware.xbot.timing import LeakyCounter
from solfer.pipes import Inbox, Middleware

logger = logging.getLogger(__name__)

COMPONENT = "component"
"""The stage of a plugin's cycle that is its component's own."""

CYCLE, OVERHEAD, LATENESS = range(len(LOOP))


@dataclass(frozen=True)
class Rules:
    """What the executor lets pass.

    Attributes:
        blend: Shortest time in which commands blend in from the measured state at a start [s].
        budget: Share of the period that a component may take.
        overruns: Overruns that are not forgiven, of the loop or of a component's budget, at which it is stopped.
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
        middleware: Clock, and the way in which it is asked to switch plugins.
        estop: The emergency stop.
        board: Where it tells about itself; None: a private one.
        rules: What it lets pass.
        nanoseconds: Clock for how long things take [ns]; a virtual one makes every run the same to the bit.
        polls: Called at the beginning of each cycle: what takes calls and replies for the plugins.
        black_box: Takes down each cycle; None: nothing is recorded.

    Attributes:
        board: Its figures.
        switchboard: Starts and stops the plugins.

    Raises:
        MiddlewareError: There is no plugin, two have one name, or their rates differ.
    """

    def __init__(self, plugins: Sequence[Cyclic], middleware: Middleware, estop: EmergencyStop,
                 board: Board | None = None, rules: Rules | None = None,
                 nanoseconds: Callable[[], int] = monotonic_ns, polls: Sequence[Callable[[], None]] = (),
                 black_box: BlackBox | None = None):
        _check(plugins)
        self._rules, self._ns, self._middleware, self.estop = rules or Rules(), nanoseconds, middleware, estop
        self.rate = plugins[0].rate
        self._period = round(1e9 / self.rate)
        self.plugins = tuple(Managed(plugin, self._rules.blend) for plugin in plugins)
        stages = plugins[0].stages.names
        self.board = board or Board(self.rate, [plugin.name for plugin in plugins], stages)
        self._component, self._times = stages.index(COMPONENT), self._collect(plugins)
        self._budget = int(self._rules.budget * self._period)
        self._over = [LeakyCounter(self._rules.overruns) for _ in plugins]
        self._since = [0] * len(plugins)  # cycle in which a plugin began to run
        self._late = LeakyCounter(self._rules.overruns)
        self._cycles, self._polls, self._black_box = 0, tuple(polls), black_box
        self.inbox, self.switchboard = Inbox(), Switchboard(self.plugins, estop)
        for index, (plugin, managed) in enumerate(zip(plugins, self.plugins, strict=True)):
            plugin.stages.nanoseconds = nanoseconds
            managed.changed = lambda changed, index=index: self._note(index, changed)
            managed.initialize()
        self.switchboard.serve(middleware, self.inbox.submit)

    def cycle(self, late: int = 0) -> None:
        """One cycle, which began `late` after its deadline [ns]. Raises nothing that a plugin raises."""
        board, begin = self.board, self._ns()
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
                self._judge(index, managed, took)
        end = self._ns()
        if self._black_box is not None:
            self._black_box.take(end, late, end - begin)
            end = self._ns()
        self._cycles += 1
        taken, counts = self._taken, board.counts
        taken[CYCLE], taken[OVERHEAD], taken[LATENESS] = end - begin, end - begin - components, late
        tally(board.histograms.rows, taken, len(LOOP))
        self._count(late + end - begin)
        counts[0], counts[4] = self._cycles, end
        board.beat(monotonic_ns())

    def run(self, running: Callable[[], bool] | None = None) -> None:
        """Cycle while `running` (default: until the middleware ends), then stop and close all plugins.

        Deadlines are absolute. A loop that is late leaves out whole periods and never makes up for them.
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
                middleware.sleep_until(begin + 1e-9 * turn * period)
        finally:
            self.close()

    def close(self) -> None:
        """Stop and close all plugins."""
        for managed in self.plugins:
            managed.close()

    def _collect(self, plugins: Sequence[Cyclic]) -> list[memoryview]:
        """One array for all times of a cycle, in the board's rows, and the part of each plugin [ns]."""
        self._taken = np.zeros(len(self.board.histograms.rows), dtype=np.int64)
        words = memoryview(self._taken).cast("B").cast("q")
        for index, plugin in enumerate(plugins):
            first = self.board.row(index, 0)
            plugin.stages.times = words[first : first + len(plugin.stages.names)]
        return [plugin.stages.times for plugin in plugins]

    def _skip(self, periods: int, late: int) -> None:
        """Periods are left out: take down what took longest, the wake-up, which was `late` [ns], or a stage."""
        board, longest, row = self.board, late, LATENESS
        for index, times in enumerate(self._times):
            for stage, time in enumerate(times):
                if time > longest:
                    longest, row = time, board.row(index, stage)
        board.counts[1] += periods
        board.skips[row] += periods

    def _obey(self) -> None:
        """The emergency stop is tripped: everybody holds."""
        for managed in self.plugins:
            if managed.active:
                managed.abort(f"emergency stop: {self.estop.reason}")

    def _judge(self, index: int, managed: Managed, took: int) -> None:
        """A plugin whose component `took` too long [ns] too often is aborted."""
        if not managed.active or self._cycles < self._since[index] + self._rules.grace:
            return
        counter, slow = self._over[index], took > self._budget
        often = counter.add(slow)
        if not slow:
            return
        self._note(index, managed)
        if often:
            counter.reset()
            managed.abort(f"its component took {1e-6 * took:.3f} ms, and more than its budget of "
                          f"{1e-6 * self._budget:.3f} ms too often")

    def _count(self, taken: int) -> None:
        """Judge the end of a cycle, `taken` after its deadline [ns]; too many late ones are a safe stop."""
        counts, late = self.board.counts, self._late
        if self._cycles <= self._rules.grace:
            return
        often = late.add(taken > self._period)
        counts[2], counts[3] = late.total, late.count
        if not often:
            return
        late.reset()
        slowest = max(range(len(self.plugins)), key=lambda index: sum(self._times[index]))
        reason = (f"safe stop: {self._rules.overruns} cycles too long, the newest {1e-6 * taken:.3f} ms of "
                  f"{1e-6 * self._period:.3f} ms; the slowest is '{self.plugins[slowest].name}' with "
                  f"{1e-6 * sum(self._times[slowest]):.3f} ms")
        logger.error("%s", reason)
        for managed in self.plugins:
            if managed.active:
                managed.abort(reason)

    def _note(self, index: int, managed: Managed) -> None:
        """Tell of a plugin's new stage."""
        if managed.stage is Stage.STARTING and not managed.plugin.running:
            self._since[index] = self._cycles
            self._over[index].reset()
        self.board.put_life(index, managed.stage, managed.starts, managed.aborts, self._over[index].total)
        self.board.put_text(managed.reason, index)
        if self._black_box is not None:
            self._black_box.stages[index] = managed.stage


def _check(plugins: Sequence[Cyclic]) -> None:
    if not plugins:
        raise MiddlewareError("an RT layer without plugins", expected="at least one")
    names = [plugin.name for plugin in plugins]
    for name in names:
        if names.count(name) > 1:
            raise MiddlewareError(f"the plugin '{name}' is listed {names.count(name)} times", expected="each once")
    for plugin in plugins:
        if plugin.rate != plugins[0].rate:
            raise MiddlewareError(f"'{plugin.name}' at {plugin.rate:g} Hz in an RT layer of {plugins[0].rate:g} Hz",
                                  expected="one rate for all plugins of a layer")

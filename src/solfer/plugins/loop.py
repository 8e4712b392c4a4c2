"""The control loop: fixed rate, absolute deadlines, and statistics of how well it kept them."""

import gc
import logging

import numpy as np

from solfer.errors import ClaimRefused, ComponentError, OutOfLimits, ReceiveTimeout, located
from solfer.plugins.plugin import Plugin
from solfer.throttle import Throttle
from solfer.transport import Middleware

logger = logging.getLogger(__name__)

REPORT_PERIOD = 1.0
"""Time between two health reports [s]."""

NOTICEABLE = 0.02
"""Shortest delay with a warning [s]; shorter ones, frequent on a shared machine, are only counted."""


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

    def add(self, cost: float, transport: float, late: float) -> None:
        """Add a cycle: its `cost` without `transport`, that of the transport, and how `late` it started [s]."""
        self._times[:, self.cycles % self._times.shape[1]] = cost, transport, late
        self.cycles += 1

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


def run(plugin: Plugin, middleware: Middleware) -> LoopStatistics:
    """Run a plugin until the middleware ends; then stop and close it.

    A loop that is late, because of a long cycle or because it was woken late, skips whole periods and never bursts:
    each cycle starts in a period of its own.

    Raises:
        ComponentError: The component failed; the robot was brought to rest before.
        ClaimRefused: Another plugin commands a joint of this one, which has sent nothing since its request.
        ReceiveTimeout: A required feedback did not arrive in time.
        OutOfLimits: The plugin would have started with a joint outside of its limits; it has commanded nothing since.
    """
    statistics = LoopStatistics()
    gc.collect()
    gc.freeze()
    failure: BaseException | None = None
    try:
        _loop(plugin, middleware, statistics)
    except BaseException as error:  # a regular end goes through `middleware.running`: what is raised is a failure
        failure = error
    late = _end(plugin, failure is not None)
    gc.unfreeze()
    failure = failure or late
    if failure is not None:
        _fail(plugin, failure)
    return statistics


def _loop(plugin: Plugin, middleware: Middleware, statistics: LoopStatistics) -> None:
    period = 1.0 / plugin.rate
    late = Throttle(logger)
    middleware.sleep_until(middleware.now())  # in lock-step with a simulation: wait for it to begin
    deadline = middleware.now()
    next_report, life = deadline + REPORT_PERIOD, plugin.life
    while middleware.running():
        start = middleware.now()
        lateness = start - deadline
        behind = int(lateness / period)
        if behind > 0:
            statistics.skipped += behind
            deadline += behind * period
            if behind * period >= NOTICEABLE:
                late.warning("late", "%s is %.0f ms late", plugin.name, 1e3 * behind * period)
        plugin.cycle()
        end = middleware.now()
        statistics.add(end - start - plugin.transport, plugin.transport, lateness)
        if end >= next_report or plugin.life is not life:
            plugin.peers.look()
            middleware.report(plugin.name, *plugin.health(), {**statistics.summary(), **plugin.figures()})
            next_report, life = end + REPORT_PERIOD, plugin.life
        deadline += period
        middleware.sleep_until(deadline)


def _end(plugin: Plugin, failed: bool) -> BaseException | None:
    """Stop, or hold if it has `failed`, then close; it is closed even if the first step fails.

    Returns:
        The first failure.
    """
    first: BaseException | None = None
    for step in (plugin.abort if failed else plugin.stop, plugin.close):
        try:
            step()
        except BaseException as error:
            logger.exception("%s fails in %s", plugin.name, step.__name__)
            first = first or error
    return first


def _fail(plugin: Plugin, failure: BaseException) -> None:
    if isinstance(failure, ClaimRefused | ReceiveTimeout | OutOfLimits):
        raise failure
    error = ComponentError(f"plugin '{plugin.name}' failed, the robot holds: {located(failure, lines=True)}")
    error.exit_code = 1
    raise error from failure

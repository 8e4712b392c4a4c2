"""The control loop: fixed rate, absolute deadlines, and figures of how well it kept them."""

import gc
import logging

import numpy as np

from solfer.errors import ClaimRefused, ComponentError, NotHeard, SolferError
from solfer.logs import Throttle
from solfer.pipes import Middleware
from solfer.plugins.plugin import Plugin

logger = logging.getLogger(__name__)

REPORT_PERIOD = 1.0
"""Time between two health reports [s]."""

NOTICEABLE = 0.02
"""Delay that is worth a warning; shorter ones are counted only, a shared machine has them all the time [s]."""


class Statistics:
    """Cost of the last cycles, without and in their transport, and their lateness, in fixed memory.

    Args:
        size: Number of cycles that are remembered.

    Attributes:
        cycles: Cycles since the start.
        skipped: Periods that were left out because the loop was late by more than one.
    """

    def __init__(self, size: int = 2048):
        self.cycles = self.skipped = 0
        self._times = np.zeros((3, size))

    def add(self, cost: float, transport: float, late: float) -> None:
        """Note a cycle: its `cost` without `transport`, that of the transport, and how `late` it started [s]."""
        self._times[:, self.cycles % self._times.shape[1]] = cost, transport, late
        self.cycles += 1

    def summary(self) -> dict[str, float]:
        """Figures in a form for reports: times in milliseconds."""
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


def run(plugin: Plugin, middleware: Middleware) -> Statistics:
    """Run a plugin until the middleware ends; then stop and close it.

    A loop that is late leaves out whole periods and never bursts.

    Raises:
        ComponentError: The component failed; the robot was brought to rest before.
        ClaimRefused: Somebody else commands a joint of the plugin, which has sent nothing since it asked.
        NotHeard: A feedback that the plugin needs has not come.
    """
    statistics = Statistics()
    gc.collect()
    gc.freeze()
    failure: Exception | None = None
    try:
        _loop(plugin, middleware, statistics)
    except Exception as error:
        failure = error
    finally:
        _end(plugin, failure is not None)
        gc.unfreeze()
    if failure is not None:
        _fail(plugin, failure)
    return statistics


def _loop(plugin: Plugin, middleware: Middleware, statistics: Statistics) -> None:
    period = 1.0 / plugin.rate
    late = Throttle(logger)
    middleware.sleep_until(middleware.now())  # in lock-step with a simulation: wait for it to begin
    deadline = middleware.now()
    next_report, life = deadline + REPORT_PERIOD, plugin.life
    while middleware.running():
        start = middleware.now()
        plugin.cycle()
        end = middleware.now()
        statistics.add(end - start - plugin.transport, plugin.transport, start - deadline)
        if end >= next_report or plugin.life is not life:
            middleware.report(plugin.name, *plugin.health(), {**statistics.summary(), **plugin.figures()})
            next_report, life = end + REPORT_PERIOD, plugin.life
        deadline += period
        behind = int((end - deadline) / period)
        if behind > 0:
            statistics.skipped += behind
            deadline += behind * period
            if behind * period >= NOTICEABLE:
                late.warning("late", "%s is %.0f ms late", plugin.name, 1e3 * behind * period)
        middleware.sleep_until(deadline)


def _end(plugin: Plugin, failed: bool) -> None:
    """Stop, or, where it has `failed`, hold, and close; a failure of the one does not keep from the other."""
    for step in (plugin.abort if failed else plugin.stop, plugin.close):
        try:
            step()
        except Exception:
            logger.exception("%s fails in %s", plugin.name, step.__name__)


def _fail(plugin: Plugin, failure: Exception) -> None:
    if isinstance(failure, ClaimRefused | NotHeard):
        raise failure
    text = str(failure) if isinstance(failure, SolferError) else f"{type(failure).__name__}: {failure}"
    error = ComponentError(f"plugin '{plugin.name}' failed, the robot holds: {text}")
    error.exit_code = 1
    raise error from failure

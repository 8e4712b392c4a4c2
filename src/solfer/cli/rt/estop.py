"""The action `solfer rt estop`, which fails unless all plugins obey."""

import time

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.memory.namespace import Namespace
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.namespaces import no_layer
from solfer.realtime.telemetry.statistics_memory import RuntimeStatistics
from solfer.transport.plugin_state import ACTIVE, PluginState

PATIENCE = 2.0
"""Longest time until the layer reads the latch, which it does in each cycle [s]."""

EVERY = 0.005
"""Period at which the latch is polled [s]."""


def trip(namespace: Namespace, reason: str) -> None:
    """Trip the emergency stop of a namespace, and print which process obeys.

    Raises:
        MiddlewareError: No RT layer lives there, it has not read the latch, or a plugin cannot hold. The latch is
            set in any case.
    """
    stop, begin = EmergencyStopLatch(namespace.folder), time.monotonic_ns()
    stop.trip(reason)
    statistics = _statistics(namespace)
    if statistics is None:
        raise _not_obeyed(namespace)
    while not (stop.answered >= begin and _stopped(statistics)):
        if not statistics.alive:
            raise _not_obeyed(namespace)
        if time.monotonic_ns() > begin + 1e9 * PATIENCE:
            raise MiddlewareError(
                f"no plugin obeys yet: process {statistics.pid} has not read the emergency stop for {PATIENCE:g} s",
                where=str(namespace.folder),
                expected=f"an RT layer that cycles; end process {statistics.pid}: the robot holds when it is gone",
            )
        time.sleep(EVERY)
    for index, name in enumerate(statistics.plugins):
        if statistics.state(index) is PluginState.FAULT:
            raise MiddlewareError(
                f"'{name}' cannot hold: {statistics.text(index)}",
                where=str(namespace.folder),
                expected=f"a new start: end process {statistics.pid}, the robot holds when it is gone",
            )
    print(f"process {statistics.pid} obeys: {', '.join(statistics.plugins)} at rest")


def _statistics(namespace: Namespace) -> RuntimeStatistics | None:
    """Return the statistics of the layer that lives; None if there is none."""
    try:
        statistics = RuntimeStatistics.attach(namespace.folder)
    except MiddlewareError:
        return None
    return statistics if statistics.alive else None


def _stopped(statistics: RuntimeStatistics) -> bool:
    return not any(statistics.state(index) in ACTIVE for index in range(len(statistics.plugins)))


def _not_obeyed(namespace: Namespace) -> MiddlewareError:
    error = no_layer(namespace)
    what = f"no plugin obeys: {error.what}"
    return MiddlewareError(what, where=error.where, expected=error.expected, names=error.names)

"""The action `solfer rt estop`, which fails unless all plugins obey."""

import time

from solfer.errors import MiddlewareError
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.namespaces import layer_of, no_layer
from solfer.segments.namespace import Namespace

LATCH_TIMEOUT = 2.0
"""Longest time until the layer reads the latch, which it does in each cycle [s]."""


def trip(namespace: Namespace, reason: str) -> None:
    """Trip the emergency stop of a namespace, and print which process obeys.

    Raises:
        MiddlewareError: No RT layer lives there, it has not read the latch, or a plugin cannot hold. The latch is
            set in any case.
    """
    stop = EmergencyStopLatch(namespace.folder)
    begin = time.monotonic_ns()
    stop.trip(reason)
    layer = layer_of(namespace.folder)
    while stop.answered < begin:
        if layer is None or not layer.owned():
            error = no_layer(namespace)
            what = f"no plugin obeys: {error.what}"
            raise MiddlewareError(what, where=error.where, expected=error.expected, names=error.names)
        if time.monotonic_ns() > begin + 1e9 * LATCH_TIMEOUT:
            raise MiddlewareError(
                f"no plugin obeys yet: process {layer.pid} has not read the emergency stop for {LATCH_TIMEOUT:g} s",
                where=str(namespace.folder),
                expected=f"an RT layer that cycles; end process {layer.pid}: the robot holds when it is gone",
            )
        time.sleep(0.005)
    if not stop.holds:
        raise MiddlewareError(
            stop.answer_text,
            where=str(namespace.folder),
            expected=f"a new start: end process {stop.answer_pid}, the robot holds when it is gone",
        )
    print(f"process {stop.answer_pid} obeys: {stop.answer_text}")

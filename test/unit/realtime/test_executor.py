"""The executor's own limits, with plugins that need no robot's feedback."""

from support.plugins.several import PERIOD, Several

from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorRules
from solfer.realtime.telemetry.statistics_memory import LoopCount

LATE = round(1.5e9 * PERIOD)  # [ns]


def test_a_safe_stop_forgives_overruns(tmp_path):
    several = Several(names=("one", "two"))
    executor = Executor(
        several.plugins,
        MemoryMiddleware(several.bus, "xbot"),
        EmergencyStopLatch(tmp_path),
        rules=ExecutorRules(blend=0.0, overruns=3, grace=0),
        nanoseconds=lambda: 0,
    )
    for stops in (1, 2):
        executor.switchboard.commit(executor.switchboard.plan(["one", "two"]))
        for _ in range(2):
            executor.cycle(LATE)
        assert [managed.state for managed in executor.plugins] == [PluginState.RUNNING] * 2
        executor.cycle(LATE)
        assert [(managed.state, managed.aborts) for managed in executor.plugins] == [(PluginState.ABORTED, stops)] * 2
        assert executor.plugins[0].reason.startswith("safe stop: 3 cycles too long, the newest 7.500 ms of 5.000 ms")
    assert executor.statistics.counts[LoopCount.OVERRUNS] == 6
    executor.close()

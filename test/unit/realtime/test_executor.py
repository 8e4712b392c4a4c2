"""The executor's own limits, with plugins that need no robot's feedback."""

import os
from types import SimpleNamespace

import pytest
from support.plugins.several import PERIOD, Several

from solfer.errors import MiddlewareError
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState
from solfer.plugins.timing.cycle_timing import STAGES
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorRules, ExecutorTelemetry
from solfer.telemetry.statistics import LoopCount, LoopTime

LONG = 2.6 * PERIOD
"""A cycle for which there may be a safe stop [s]."""


def patient_for_three(several, folder, interruptions=None):
    """Make an executor that stops at the third cycle that is too long, on a clock that goes on in components alone."""
    return Executor(
        several.plugins,
        MemoryMiddleware(several.bus, "xbot"),
        EmergencyStopLatch(folder),
        rules=ExecutorRules(blend=0.0, budget=100.0, overruns=3, grace=0),
        telemetry=ExecutorTelemetry(nanoseconds=lambda: several.worked, interruptions=interruptions),
    )


def test_a_safe_stop_forgives_long_cycles(tmp_path):
    """After a safe stop the next start has its full allowance again; otherwise one long cycle would end it."""
    several = Several(names=("one", "two"))
    executor = patient_for_three(several, tmp_path)
    several.plugins[0].component.lasts = LONG
    for stops in (1, 2):
        executor.switchboard.commit(executor.switchboard.plan(["one", "two"]))
        for _ in range(2):
            executor.cycle()
        assert [managed.state for managed in executor.plugins] == [PluginState.RUNNING] * 2
        executor.cycle()
        assert [(managed.state, managed.aborts) for managed in executor.plugins] == [(PluginState.ABORTED, stops)] * 2
        reason = executor.plugins[0].reason
        assert reason.startswith("safe stop: 3 cycles of more than 2.5 periods, the newest 13.000 ms of 5.000 ms")
    assert executor.statistics.counts[LoopCount.OVERRUNS] == 6
    executor.close()


def test_cycles_that_a_standing_robot_bears_are_no_safe_stop(tmp_path):
    """They are overruns, for which motions slow down; every second cycle may be longer still."""
    several = Several(names=("one", "two"))
    executor = patient_for_three(several, tmp_path)
    executor.switchboard.commit(executor.switchboard.plan(["one", "two"]))
    for cycle in range(40):
        several.plugins[0].component.lasts = LONG if cycle % 2 else 2.4 * PERIOD
        executor.cycle(round(0.5e9 * PERIOD))
    assert [managed.state for managed in executor.plugins] == [PluginState.RUNNING] * 2
    assert executor.statistics.counts[LoopCount.OVERRUNS] == 40
    executor.close()


class Interrupted:
    """How long cycles are kept from running, as a test sets it [ns]."""

    time = 0

    def start(self):
        """Begin with a cycle."""

    def in_cycle(self):
        """Return how long it was interrupted."""
        return self.time


@pytest.mark.parametrize("is_kept", [False, True])
def test_a_cycle_that_was_kept_from_running_is_no_overrun(tmp_path, is_kept):
    """Neither is the next one, which begins late for that."""
    several = Several(names=("one", "two"))
    interruptions = Interrupted()
    executor = patient_for_three(several, tmp_path, interruptions)
    executor.switchboard.commit(executor.switchboard.plan(["one", "two"]))
    component = several.plugins[0].component
    interruptions.time = round(1e9 * LONG) if is_kept else 0
    for _ in range(10):
        component.lasts = LONG
        executor.cycle()
        component.lasts = 0.0
        executor.cycle(round(1e9 * LONG) if is_kept else 0)
    assert executor.statistics.counts[LoopCount.OVERRUNS] == (0 if is_kept else 10)
    interruptions.time = 0
    component.lasts = LONG
    for _ in range(4):
        executor.cycle()
    assert [managed.state for managed in executor.plugins] == [PluginState.ABORTED] * 2


class TwoPlugins:
    """An executor of two plugins that need no feedback, on a clock that a test sets, and one that records."""

    def __init__(self, folder, **rules):
        self.several, self.time, self.begins = Several(names=("one", "two")), 0, 0
        self.recorded, self.noted = [], []
        node = MemoryMiddleware(self.several.bus, "xbot")
        self.stop = EmergencyStopLatch(folder)
        box = SimpleNamespace(
            record=lambda *cycle: self.recorded.append(cycle),
            note=lambda index, managed, time: self.noted.append((index, managed.state)),
        )
        self.executor = Executor(
            self.several.plugins,
            node,
            self.stop,
            rules=ExecutorRules(**{"blend": 0.0, "grace": 0, **rules}),
            telemetry=ExecutorTelemetry(nanoseconds=lambda: self.time + self.several.worked, black_box=box),
        )

    def start(self):
        """Start both plugins."""
        switchboard = self.executor.switchboard
        switchboard.commit(switchboard.plan(["one", "two"]))

    def states(self):
        """Return the states of both."""
        return [managed.state for managed in self.executor.plugins]


@pytest.fixture
def layer(tmp_path):
    made = TwoPlugins(tmp_path)
    yield made
    made.executor.close()


def test_a_stop_aborts_and_is_answered(layer):
    """`solfer rt estop` waits for the answer; starts are refused, with the reason, until the stop is cleared."""
    layer.start()
    layer.executor.cycle()
    assert layer.stop.answered == 0 and layer.states() == [PluginState.RUNNING] * 2
    layer.stop.trip("too warm")
    layer.executor.cycle()
    assert layer.states() == [PluginState.ABORTED] * 2 and layer.stop.answered > 0
    assert layer.stop.holds and layer.stop.answer_text == "one, two at rest" and layer.stop.answer_pid == os.getpid()
    assert [managed.reason for managed in layer.executor.plugins] == [f"emergency stop: {layer.stop.reason}"] * 2
    assert layer.executor.statistics.text(1) == f"emergency stop: {layer.stop.reason}"
    with pytest.raises(MiddlewareError) as refused:
        layer.start()
    assert refused.value.what == f"the emergency stop is tripped: {layer.stop.reason}"
    name = layer.stop.segment.path.parent.name.removeprefix("solfer-")
    cure = f"`solfer rt estop --clear --namespace {name}`, or the service xbotcore/estop_clear, first"
    assert refused.value.expected == cure
    layer.executor.clear()
    layer.start()
    layer.executor.cycle()
    assert layer.states() == [PluginState.RUNNING] * 2


def test_after_a_stop_no_component_is_called(layer):
    """One that hangs would keep the layer from its answer, and its process from ending."""
    layer.start()
    layer.executor.cycle()
    one = layer.several.components[0]
    one.update = one.stop = lambda: pytest.fail("it is called")
    layer.stop.trip("a hang")
    layer.executor.cycle()
    layer.executor.cycle()
    layer.executor.close()
    assert layer.states() == [PluginState.ABORTED] * 2


def test_services_trip_and_clear_the_stop(layer):
    bus = layer.several.bus
    answers = [bus.call(f"xbotcore/{name}") for name in ("estop", "estop_clear")]
    layer.start()
    layer.executor.cycle()
    assert [answer.result().success for answer in answers] == [True, False]
    assert answers[1].result().message.startswith("the emergency stop stays: one, two not at rest")
    assert layer.stop.reason.startswith("by service (")
    layer.executor.cycle()
    answer = bus.call("xbotcore/estop_clear")
    layer.executor.cycle()
    assert answer.result().success and not layer.stop


def test_a_cycle_is_measured_by_its_parts(layer):
    layer.start()
    layer.executor.cycle()
    layer.several.components[0].lasts, layer.several.components[1].lasts = 0.001, 0.0005
    layer.time += 7
    layer.executor.cycle(300)
    worked = 1_500_000
    durations = dict(zip(LoopTime, layer.executor._durations, strict=False))
    assert durations == {LoopTime.CYCLE: worked, LoopTime.OVERHEAD: 0, LoopTime.LATENESS: 300}
    assert layer.recorded == [(0, 0, 0), (7 + worked, 300, worked)]
    counts = layer.executor.statistics.counts
    assert (counts[LoopCount.CYCLES], counts[LoopCount.TIME]) == (2, 7 + worked)
    states = [PluginState.INITIALIZED, PluginState.STARTING, PluginState.RUNNING]
    assert [state for index, state in layer.noted if index == 1] == states


@pytest.mark.parametrize(
    ("lasts", "late", "skipped", "rows"),
    [
        ((0.0, 0.012), 0.002, 2, ("two",)),  # 12 ms of 5 ms: two periods, and 2 ms of the third one
        ((0.006, 0.0055), 0.0015, 2, ("one",)),
        ((0.001, 0.0), 0.006, 1, ()),  # the machine: woke up too late
    ],
)
def test_skipped_periods_count_for_their_cause(layer, lasts, late, skipped, rows):
    layer.start()
    layer.executor.cycle()
    for component, time in zip(layer.several.components, lasts, strict=True):
        component.lasts = time
    layer.executor.cycle()
    layer.executor._run_cycle(late, skipped)
    statistics = layer.executor.statistics
    names = [managed.name for managed in layer.executor.plugins]
    row = statistics.row(names.index(rows[0]), STAGES.index("component")) if rows else int(LoopTime.LATENESS)
    assert statistics.counts[LoopCount.SKIPPED] == skipped
    assert {index: count for index, count in enumerate(statistics.skips) if count} == {row: skipped}


def test_what_a_cycle_took_counts_once(layer):
    layer.start()
    layer.executor.cycle()
    layer.several.components[0].lasts = 0.012
    layer.executor.cycle()
    layer.several.components[0].lasts = 0.0
    layer.executor._run_cycle(0.0075, 2)
    # two periods were skipped for the cycle before; one of them is what it lasted beyond its own
    assert layer.recorded[-1][1] == round(0.0075e9) - round(1e9 * PERIOD)


def test_work_beside_is_done_ten_times_a_second(tmp_path):
    done, several = [], Several(names=("one",))
    executor = Executor(
        several.plugins,
        MemoryMiddleware(several.bus, "xbot"),
        EmergencyStopLatch(tmp_path),
    )
    executor.beside = lambda: done.append(1)
    several.bus.every(1.0, several._end)
    executor.run()
    assert len(done) == 10 and executor.plugins[0].state is PluginState.CLOSED


def test_grace_forgives_the_first_cycles(tmp_path):
    layer = TwoPlugins(tmp_path, grace=4, overruns=2, budget=100.0)
    layer.start()
    layer.several.plugins[0].component.lasts = LONG
    for count in (0, 0, 0, 0, 1):
        layer.executor.cycle()
        assert layer.executor.statistics.counts[LoopCount.OVERRUNS] == count
    assert layer.states() == [PluginState.RUNNING] * 2
    layer.executor.cycle()
    assert layer.states() == [PluginState.ABORTED] * 2
    layer.executor.close()

"""A plugin that fails in shared memory under the executor, and one that is stopped; on a virtual clock."""

import re

import numpy as np
import pytest
from support.integration.fault_layer import AT_ONCE, LARGEST_STEP, PLUGIN, RATE, SAG, FaultLayer, moving

from solfer.errors import MiddlewareError
from solfer.plugins import PluginState
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import ExecutorRules
from solfer.telemetry.statistics import LOOP_HISTOGRAMS
from solfer.transport.lower_level import REFUSALS_TOPIC
from solfer.transport.messages import REFUSALS, JointMessage

LEASE = 0.3
"""Time after which the lower level ends a claim without commands [s]."""


TOGETHER = 2
"""Cycles with commands that arrive at the same time: one that ended late, and the next, which is late."""


@pytest.fixture
def layer(shared, tmp_path):
    return FaultLayer(shared, tmp_path, [(PLUGIN, moving(tmp_path))])


def fail(step):
    """Return a step of a life that fails."""

    def failing():
        raise RuntimeError(f"sabotage in {step}")

    return failing


def check_that_it_holds(layer, moment, cycles=AT_ONCE):
    """Check that the robot was to hold in time, without a step, stands still, and has no owner any more."""
    simulation = layer.world.simulation
    layer.world.run(0.3)
    assert layer.cycles_until_rest(moment) <= cycles
    assert layer.largest_step(layer.moved) <= LARGEST_STEP
    assert not simulation.lower_level.claims.owners()
    assert np.abs(simulation.v[layer.wheels]).max() < 0.05


@pytest.mark.daily(1)
@pytest.mark.parametrize("step", ["update", "send"])
def test_an_exception_in_a_cycle_aborts_the_plugin(layer, step):
    layer.begin_with()
    moment = layer.move()
    setattr(layer[PLUGIN].plugin.component, step, fail(step))
    check_that_it_holds(layer, moment)
    assert layer[PLUGIN].state is PluginState.ABORTED
    assert re.fullmatch(
        rf"RuntimeError: sabotage in {step} \(at {re.escape(__file__)}:\d+ in \w+\)", layer[PLUGIN].reason
    )
    assert layer.executor.statistics.text(0) == layer[PLUGIN].reason


def test_an_exception_in_init_aborts_before_commands(layer):
    layer[PLUGIN].plugin.component.init = fail("init")
    layer.begin_with(until=PluginState.ABORTED)
    assert "sabotage in init" in layer[PLUGIN].reason and layer.largest_step() == 0.0
    check_that_it_holds(layer, 0.0, cycles=0)


def test_an_exception_in_stop_aborts_the_plugin(layer):
    layer.begin_with()
    moment = layer.move()
    layer[PLUGIN].plugin.component.stop = fail("stop")
    statistics = layer.executor.switchboard
    statistics.commit(statistics.plan(stop=[PLUGIN]))
    check_that_it_holds(layer, moment)
    assert layer[PLUGIN].state is PluginState.ABORTED and "sabotage in stop" in layer[PLUGIN].reason


def test_an_exception_in_close_is_a_fault(layer):
    layer.begin_with()
    moment = layer.move()
    layer[PLUGIN].plugin.component.close = fail("close")
    layer.executor.close()
    check_that_it_holds(layer, moment)
    assert layer[PLUGIN].state is PluginState.FAULT and "sabotage in close" in layer[PLUGIN].reason


@pytest.mark.daily(1)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_command_with_nan_aborts_its_plugin(layer, value):
    """One non-finite number among good commands never reaches the joints, and the reason names joint and field."""
    layer.begin_with()
    component = layer[PLUGIN].plugin.component
    moment, send, yaw, left = layer.move(), component.send, component.model.dof("torso_yaw"), [20]

    def broken():
        send()
        left[0] -= 1
        if not left[0]:
            component.model.command.position[yaw] = value

    component.send = broken
    check_that_it_holds(layer, moment + 20 / RATE)
    reason = layer[PLUGIN].reason
    assert layer[PLUGIN].state is PluginState.ABORTED
    assert f"{PLUGIN} commands a 'position' of joint 'torso_yaw' that is not a finite number" in reason


def test_a_command_of_a_stranger_is_refused(shared):
    position = shared.simulation.lower_level.controllers["position_controller"]
    stranger, before = shared.node("stranger"), position.position.copy()
    refusals = stranger.queue(REFUSALS_TOPIC, REFUSALS)
    command = JointMessage(position.joints, position=before + 0.1)
    command.position[7] = np.nan
    stranger.writer("position_controller/command", "solfer/JointCommand").write(command)
    shared.run(0.1)
    published = refusals.drain()
    assert [(message.owners, message.claims) for message in published] == [(("stranger",), (False,))]
    assert f"position nan of joint '{position.joints[7]}' is not a finite number" in published[0].reasons[0]
    np.testing.assert_array_equal(position.position, before)


def test_an_emergency_stop_holds_within_a_cycle(layer, tmp_path):
    layer.begin_with()
    moment = layer.move()
    EmergencyStopLatch(tmp_path / "stop").trip("a hand on the button")  # as another process would
    check_that_it_holds(layer, moment)
    assert layer[PLUGIN].state is PluginState.ABORTED and "a hand on the button" in layer[PLUGIN].reason
    with pytest.raises(MiddlewareError, match="a hand on the button"):
        layer.begin_with()
    layer.executor.clear()
    layer.world.run(0.2)
    assert layer[PLUGIN].state is PluginState.ABORTED  # nothing starts by itself
    layer.begin_with()
    layer.move()
    assert layer.largest_step(moment) <= SAG


class Timed(FaultLayer):
    """Its cycles are those of the executor's own loop, which goes by the time of the world."""

    def begin(self):
        """Nothing is put on the bus."""

    def loop(self, until, *actions):
        """Cycle until a time [s]; before, do each of `actions`, a time [s] and what is done then."""
        waiting = sorted(actions, key=lambda action: action[0])

        def running():
            while waiting and self.now >= waiting[0][0]:
                waiting.pop(0)[1]()
            return self.now < until

        self.executor.run(running)


@pytest.fixture
def timed(shared, tmp_path):
    """Run a layer that has no grace, with a component that may take as long as it likes."""
    made = Timed(
        shared, tmp_path, [(PLUGIN, moving(tmp_path))], ExecutorRules(blend=0.1, budget=100.0, overruns=20, grace=0)
    )
    made.executor.plugins[0].start()
    return made


def slow(layer, periods, times):
    """Let a component take as long as some periods, as often as `times`."""
    component, left = layer[PLUGIN].plugin.component, [times]
    update, bus = component.update, layer.world.bus

    def late():
        update()
        if left[0] > 0:
            left[0] -= 1
            bus.run_until(bus.time + periods / RATE)

    component.update = late


@pytest.mark.daily(1)
@pytest.mark.parametrize("periods", [1, 7])
def test_one_overrun_leaves_out_whole_periods(timed, periods):
    statistics, seen = timed.executor.statistics, []
    timed.loop(
        1.5,
        (0.5, timed.ask_to_move),
        (1.0, lambda: slow(timed, periods + 1.5, 1)),
        (1.2, lambda: seen.append((timed[PLUGIN].state, *statistics.counts[:4]))),
    )
    ((stage, cycles, skipped, overruns, unforgiven),) = seen
    assert (stage, skipped, overruns, unforgiven) == (PluginState.RUNNING, periods, 1, 0)
    assert cycles + periods == pytest.approx(1.2 * RATE, abs=3)  # they are not made up for
    assert statistics.skips[statistics.row(0, statistics.stages.index("component"))] == periods
    assert timed.largest_step(0.5) <= (TOGETHER + periods) * LARGEST_STEP  # the motion goes on by what was left out


def test_many_overruns_are_a_safe_stop(timed):
    timed.loop(2.0, (0.5, timed.ask_to_move), (1.0, lambda: slow(timed, 2.6, 1000)))
    reason = timed[PLUGIN].reason
    assert timed[PLUGIN].state is PluginState.ABORTED and "safe stop: 20 cycles of more than 2.5 periods" in reason
    assert timed.cycles_until_rest(1.0) <= 3 * 20 + AT_ONCE  # each of the 20 takes three periods
    assert timed.largest_step(0.5) <= 3 * LARGEST_STEP


@pytest.mark.soak
def test_a_loop_that_stood_still_begins_anew(timed):
    """After a second without cycles the claims have ended, and the old motion must not resume by itself.

    Skipped periods are counted, and commands start where the robot is measured.
    """
    statistics, bus, seen = timed.executor.statistics, timed.world.bus, []
    timed.loop(
        2.5,
        (0.5, timed.ask_to_move),
        (1.0, lambda: bus.run_until(2.0)),
        (2.4, lambda: seen.append((timed[PLUGIN].state, *statistics.counts[:3]))),
    )
    ((stage, cycles, skipped, overruns),) = seen
    assert (stage, overruns) == (PluginState.RUNNING, 1)
    assert skipped == pytest.approx(1.0 * RATE, abs=3) and cycles + skipped == pytest.approx(2.4 * RATE, abs=3)
    assert statistics.skips[LOOP_HISTOGRAMS.index("lateness")] == skipped
    meanwhile = [speed for time, _, speed in timed.rows if 1.0 + LEASE + AT_ONCE / RATE <= time < 1.99]
    assert not np.any(meanwhile)  # the lower level ends claims without commands
    assert not any(np.any(speed) for time, _, speed in timed.rows if time >= 2.0)  # what was asked for is forgotten
    assert timed.largest_step(0.5) <= SAG  # where the robot is measured

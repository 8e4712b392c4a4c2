"""A plugin whose commands the lower level refuses: it says so, holds, and goes on when it may; on the virtual clock."""

import logging

import numpy as np
import pytest
from test_hardware_plugin import HardwareWorld
from test_hardware_plugin import configuration as hardware
from test_plugin import WHEELS
from test_plugin_claims import command, drive, kill, owners
from world import CONFIG

from solfer.config import load
from solfer.errors import ClaimRefused
from solfer.middleware.memory import MemoryMiddleware
from solfer.pipes.lower_level import REFUSED
from solfer.pipes.messages import REFUSALS, RefusalMessage
from solfer.plugins import Life, Registry, generate, run

TOLERANCE = 0.05  # [rad], what springs give way to the weight when the robot is held anew


def said(caplog, text):
    """What plugins logged about `text`."""
    return [record.getMessage() for record in caplog.records
            if record.name.startswith("solfer.plugins") and text in record.getMessage()]


def speeds(world):
    """Of the wheels [rad/s]."""
    return world.simulation.v[[world.simulation.kinematics.dofs.index(name) for name in WHEELS]]


def joints(world):
    """Positions of the joints on springs [rad]."""
    return world.simulation.q[world.simulation.lower_level.controllers["position_controller"].dofs].copy()


def moves_again(world):
    """The plugin obeys a request: wheels turn and a joint moves."""
    request = {"velocities": (1.0,) * 4 + (0.0,), "positions": (0.0,) * 4 + (0.2,)}
    assert world.ask(joints=(*WHEELS, "neck_yaw"), **request).success
    world.run(1.5)
    assert np.abs(speeds(world) - 1.0).max() < 0.1
    assert world.simulation.q[world.simulation.kinematics.dofs.index("neck_yaw")] == pytest.approx(0.2, abs=0.02)


def test_a_plugin_waits_out_an_emergency_stop_and_refuses_requests_with_the_reason(world, caplog):
    plugin = drive(world)
    world.ask("lower_level/emergency_stop")
    world.run(0.1)
    assert plugin.life is Life.WAITING
    level, summary = plugin.health()
    assert level == 2 and "emergency stop" in summary
    early = world.bus.call("joint_states/trajectory", state="home")
    world.run(2.0)
    for part in ("'joint_states' waits for its joints", "emergency stop", "lower_level/reset_emergency_stop"):
        assert part in str(early.exception(0))
    assert len(said(caplog, "emergency stop")) == 1
    world.ask("lower_level/reset_emergency_stop")
    before = joints(world)
    world.run(1.0)
    assert plugin.life is Life.RUNNING and plugin.health() == (0, "running")
    assert np.abs(joints(world) - before).max() < TOLERANCE and np.abs(speeds(world)).max() < 0.1
    moves_again(world)


def test_a_stopped_controller_stops_its_plugin_until_it_is_started(world, caplog):
    plugin = drive(world)
    assert world.ask("lower_level/switch", stop=("position_controller",)).success
    world.run(0.5)
    assert plugin.life is Life.WAITING and set(owners(world).values()) == {""}
    assert np.abs(speeds(world)).max() < 0.05  # its other controller rests as well
    assert len(said(caplog, "controller 'position_controller' is stopped")) == 1
    before = joints(world)
    assert world.ask("lower_level/switch", start=("position_controller",)).success
    world.run(1.0)
    assert plugin.life is Life.RUNNING and np.abs(joints(world) - before).max() < TOLERANCE
    moves_again(world)


def test_a_plugin_that_is_asked_to_begin_in_an_emergency_stop_begins_after_it(world):
    world.run(0.1)
    world.ask("lower_level/emergency_stop")
    plugin = world.plugin("joint_states")
    world.run(1.0)
    assert plugin.life is Life.WAITING and world.simulation.lower_level.refused == 0
    world.ask("lower_level/reset_emergency_stop")
    world.run(1.0)
    moves_again(world)


def test_a_plugin_begins_anew_where_a_reset_of_the_simulation_has_put_the_robot(world):
    plugin = drive(world)
    assert world.ask("simulator/reset", state="mammal_wide_high").success
    before = joints(world)
    world.run(0.5)
    assert plugin.life is Life.RUNNING and set(owners(world).values()) != {""}
    assert np.abs(joints(world) - before).max() < TOLERANCE and np.abs(speeds(world)).max() < 0.1
    moves_again(world)


def test_a_lower_level_that_has_forgotten_everything_meanwhile_is_claimed_anew(world):
    plugin = drive(world)
    world.heard = False
    world.run(0.5)
    world.simulation.lower_level.claims.release("joint_states")
    world.heard = True
    world.run(0.5)
    assert plugin.life is Life.RUNNING and owners(world)["velocity_controller"] == "joint_states: velocity"
    moves_again(world)


def test_a_plugin_that_hung_while_another_took_its_joints_ends_with_both_names(world):
    plugin = drive(world)
    kill(plugin)
    world.run(0.5)
    world.bus.every(0.01, lambda: command(world, "thief", "velocity_controller", WHEELS, velocity=[0.5] * 4))
    world.run(0.1)
    plugin.life = Life.RUNNING
    with pytest.raises(ClaimRefused) as refusal:
        world.run(1.0)
    for name in ("'joint_states'", "'thief'", "j_wheel_1"):
        assert name in str(refusal.value)
    assert refusal.value.exit_code == 2
    plugin.stop()
    plugin.close()
    world.run(1.0)
    assert np.abs(speeds(world) - 0.5).max() < 0.05


def test_hardware_that_stops_in_an_emergency_tells_its_plugin(tmp_path):
    world = HardwareWorld()
    try:
        plugin = world.plugin("joint_states", hardware(tmp_path, "HW"))
        world.run(1.0)
        world.ask("lower_level/emergency_stop")
        world.run(0.5)
        assert plugin.life is Life.WAITING and "emergency stop" in plugin.health()[1]
        before = joints(world)
        world.ask("lower_level/reset_emergency_stop")
        world.run(1.0)
        assert plugin.life is Life.RUNNING
        assert np.abs(joints(world) - before).max() < 3.0 * TOLERANCE  # its springs are softer
        assert world.ask(joints=WHEELS, velocities=(1.0,) * 4).success
        world.run(1.0)
        assert np.abs(speeds(world) - 1.0).max() < 0.1
    finally:
        world.close()


def test_refusals_are_told_at_once_and_then_fifty_times_a_second(world):
    told = MemoryMiddleware(world.bus, "ear").queue(REFUSED, REFUSALS)
    lower_level = world.simulation.lower_level
    for _ in range(100):
        command(world, "wrong", "position_controller", ("torso_jaw",), position=[0.1])
        command(world, "void", "velocity_controller", WHEELS, velocity=[0.1] * 4)
        world.run(0.002)
        if world.bus.time > 0.05:
            lower_level.release("void")
    messages = told.drain()
    assert 8 <= len(messages) <= 11
    assert messages[0].owners == ("wrong",) and messages[0].stamp < 0.004
    last = dict(zip(messages[-1].owners, zip(messages[-1].claims, messages[-1].reasons, strict=True), strict=True))
    assert last["wrong"][0] is False and last["wrong"][1] == "unknown joint 'torso_jaw' (did you mean torso_yaw?)"
    assert last["void"][0] is True and "it has released its joints" in last["void"][1]


def test_a_wrong_command_is_told_and_does_not_stop_the_plugin(world, caplog):
    plugin = drive(world)
    writer = MemoryMiddleware(world.bus, "simulator").writer(REFUSED, REFUSALS)
    for _ in range(5):
        writer.write(RefusalMessage(("other", "joint_states"), (True, False), ("emergency stop", "too far")))
        world.run(0.02)
    assert plugin.life is Life.RUNNING
    assert plugin.health() == (1, "the lower level refuses a command: too far")
    assert plugin.health() == (0, "running")
    assert len(said(caplog, "too far")) == 1


def test_the_health_report_of_a_running_plugin_follows_at_once(world, caplog):
    caplog.set_level(logging.CRITICAL)
    middleware = MemoryMiddleware(world.bus, "joint_states")
    plugin = generate(load(CONFIG / "centauro.yaml", "joint_states"), middleware, Registry().find("joint_states"))
    levels = {}

    def script():
        now = round(world.bus.time, 1)
        if now == 1.2:
            world.bus.call("lower_level/emergency_stop")
        elif now == 2.2:
            world.bus.call("lower_level/reset_emergency_stop")
        elif now >= 3.5:
            world.bus.ended = True
        if "joint_states" in world.bus.reports:
            levels[now] = world.bus.reports["joint_states"].level

    world.bus.every(0.1, script)
    run(plugin, middleware)
    assert (levels[1.2], levels[1.3], levels[2.2], levels[2.6]) == (0, 2, 2, 0)


def test_gains_are_read_before_the_call_waits_for_its_turn(world, tmp_path):
    gains = CONFIG / "robots" / "centauro" / "gains.yaml"
    file = tmp_path / "gains.yaml"
    file.write_text(gains.read_text())
    reply = world.bus.call("position_controller/load_gains", file=str(file))
    file.unlink()
    assert not reply.done()
    world.run(0.02)
    assert reply.result(0).success
    wrong = world.bus.call("position_controller/load_gains", file=str(file))
    assert wrong.done() and "gains.yaml" in wrong.result(0).message  # no cycle has seen it

"""A plugin with commands that the lower level refuses: it reports it, holds, and goes on when it may; virtual clock."""

import logging

import numpy as np
import pytest
from support.integration.world import CONFIG
from support.plugins.plugin import WHEELS
from support.plugins.plugin_claims import command, drive, kill, owners
from support.plugins.plugin_refused import TOLERANCE, joints, logged, moves_again, speeds
from support.simulation.hardware_plugin import HardwareWorld
from support.simulation.hardware_plugin import configuration as hardware

from solfer.config import load
from solfer.errors import ClaimRefused
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState, Registry, generate, run
from solfer.transport.lower_level import REFUSALS_TOPIC
from solfer.transport.messages import REFUSALS, RefusalMessage


@pytest.mark.soak
def test_a_plugin_waits_out_an_emergency_stop(world, caplog):
    """It reports the stop once, refuses requests with the way out, and resumes at rest once the stop is reset."""
    plugin = drive(world)
    world.ask("lower_level/emergency_stop")
    world.run(0.1)
    assert plugin.life is PluginState.STARTING
    level, summary = plugin.health()
    assert level == 2 and "emergency stop" in summary
    early = world.bus.call("joint_states/trajectory", state="home")
    world.run(2.0)
    for part in ("'joint_states' waits for its joints", "emergency stop", "lower_level/reset_emergency_stop"):
        assert part in str(early.exception(0))
    assert len(logged(caplog, "emergency stop")) == 1
    world.ask("lower_level/reset_emergency_stop")
    before = joints(world)
    world.run(1.0)
    assert plugin.life is PluginState.RUNNING and plugin.health() == (0, "running")
    assert np.abs(joints(world) - before).max() < TOLERANCE and np.abs(speeds(world)).max() < 0.1
    moves_again(world)


def test_a_stopped_controller_stops_its_plugin(world, caplog):
    plugin = drive(world)
    assert world.ask("lower_level/switch", stop=("position_controller",)).success
    world.run(0.5)
    assert plugin.life is PluginState.STARTING and set(owners(world).values()) == {""}
    assert np.abs(speeds(world)).max() < 0.05  # its other controller rests as well
    assert len(logged(caplog, "controller 'position_controller' is stopped")) == 1
    before = joints(world)
    assert world.ask("lower_level/switch", start=("position_controller",)).success
    world.run(1.0)
    assert plugin.life is PluginState.RUNNING and np.abs(joints(world) - before).max() < TOLERANCE
    moves_again(world)


def test_a_plugin_starts_after_an_emergency_stop(world):
    world.run(0.1)
    world.ask("lower_level/emergency_stop")
    plugin = world.plugin("joint_states")
    world.run(1.0)
    assert plugin.life is PluginState.STARTING and world.simulation.lower_level.refused == 0
    world.ask("lower_level/reset_emergency_stop")
    world.run(1.0)
    moves_again(world)


def test_a_new_lower_level_is_claimed_anew(world):
    plugin = drive(world)
    world.received = False
    world.run(0.5)
    world.simulation.lower_level.claims.release("joint_states")
    world.received = True
    world.run(0.5)
    assert plugin.life is PluginState.RUNNING and owners(world)["velocity_controller"] == "joint_states: velocity"
    moves_again(world)


@pytest.mark.soak
def test_a_plugin_without_its_joints_names_both(world):
    """The error names the owner that took them as well as the joint; the thief's command stays in force afterwards."""
    plugin = drive(world)
    kill(plugin)
    world.run(0.5)
    world.bus.every(0.01, lambda: command(world, "thief", "velocity_controller", WHEELS, velocity=[0.5] * 4))
    world.run(0.1)
    plugin.life = PluginState.RUNNING
    with pytest.raises(ClaimRefused) as refusal:
        world.run(1.0)
    for name in ("'joint_states'", "'thief'", "j_wheel_1"):
        assert name in str(refusal.value)
    assert refusal.value.exit_code == 2
    plugin.stop()
    plugin.close()
    world.run(1.0)
    assert np.abs(speeds(world) - 0.5).max() < 0.05


def test_stopped_hardware_informs_its_plugin(tmp_path):
    """The refusal of a stop crosses the hardware's renamed joints too, and the plugin moves again after the reset."""
    world = HardwareWorld()
    try:
        plugin = world.plugin("joint_states", hardware(tmp_path, "HW"))
        world.run(1.0)
        world.ask("lower_level/emergency_stop")
        world.run(0.5)
        assert plugin.life is PluginState.STARTING and "emergency stop" in plugin.health()[1]
        before = joints(world)
        world.ask("lower_level/reset_emergency_stop")
        world.run(1.0)
        assert plugin.life is PluginState.RUNNING
        assert np.abs(joints(world) - before).max() < 3.0 * TOLERANCE  # its springs are softer
        assert world.ask(joints=WHEELS, velocities=(1.0,) * 4).success
        world.run(1.0)
        assert np.abs(speeds(world) - 1.0).max() < 0.1
    finally:
        world.close()


def test_refusals_are_published_at_50_hz(world):
    published = MemoryMiddleware(world.bus, "ear").queue(REFUSALS_TOPIC, REFUSALS)
    lower_level = world.simulation.lower_level
    for _ in range(100):
        command(world, "wrong", "position_controller", ("torso_jaw",), position=[0.1])
        command(world, "void", "velocity_controller", WHEELS, velocity=[0.1] * 4)
        world.run(0.002)
        if world.bus.time > 0.05:
            lower_level.release("void")
    messages = published.drain()
    assert 8 <= len(messages) <= 11
    assert messages[0].owners == ("wrong",) and messages[0].stamp < 0.004
    last = dict(zip(messages[-1].owners, zip(messages[-1].claims, messages[-1].reasons, strict=True), strict=True))
    assert last["wrong"][0] is False and last["wrong"][1] == "unknown joint 'torso_jaw' (did you mean torso_yaw?)"
    assert last["void"][0] is True and "it has released its joints" in last["void"][1]


def test_a_wrong_command_stops_no_plugin(world, caplog):
    plugin = drive(world)
    writer = MemoryMiddleware(world.bus, "simulator").writer(REFUSALS_TOPIC, REFUSALS)
    for _ in range(5):
        writer.write(RefusalMessage(("other", "joint_states"), (True, False), ("emergency stop", "too far")))
        world.run(0.02)
    assert plugin.life is PluginState.RUNNING
    assert plugin.health() == (1, "the lower level refuses a command: too far")
    assert plugin.health() == (0, "running")
    assert len(logged(caplog, "too far")) == 1


@pytest.mark.soak
def test_the_health_report_follows_at_once(world, caplog):
    """Operators read the health: it turns to error within 0.1 s of the stop, and back soon after the reset."""
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


def test_gains_are_read_before_the_call_waits(world, tmp_path):
    gains = CONFIG / "robots" / "centauro" / "gains.yaml"
    file = tmp_path / "gains.yaml"
    file.write_text(gains.read_text())
    world.simulation.lower_level.folders.add(tmp_path)
    reply = world.bus.call("position_controller/load_gains", file=str(file))
    file.unlink()
    assert not reply.done()
    world.run(0.02)
    assert reply.result(0).success
    wrong = world.bus.call("position_controller/load_gains", file=str(file))
    assert wrong.done() and "gains.yaml" in wrong.result(0).message  # no cycle has seen it

"""CENTAURO is pushed over, or one of its wheels is spun, while a plugin drives it; on the virtual clock."""

import math

import numpy as np
import pytest
from support.integration.world import ROBOT
from support.plugins.plugin_claims import command, drive, owners
from support.plugins.plugin_refused import TOLERANCE, joints, logged, moves_again, speeds

from solfer.plugins import PluginState
from solfer.simulation import Simulation
from solfer.simulation.robot_body.placement import StartPlacement
from solfer.transport.messages import JointMessage

LIMIT = math.radians(60.0)


def tilt(simulation):
    """Angle between the base's z axis and the vertical [rad]."""
    rx, ry = simulation.q[3:5]
    return math.acos(math.cos(rx) * math.cos(ry))


def watched(world, duration):
    """Let time [s] pass; in each millisecond: the tilt [rad], and the speed of the fastest wheel [rad/s]."""
    seen = []
    for _ in range(round(1000 * duration)):
        world.run(0.001)
        seen.append((tilt(world.simulation), np.abs(speeds(world)).max()))
    return np.array(seen).T


def test_a_robot_that_is_pushed_over_holds(world, caplog):
    """It drives until it tips, then stops within 0.55 s and refuses plugins and strangers alike.

    A reset of the simulator makes it move again.
    """
    plugin = drive(world)
    assert world.ask("simulator/push", link="torso_2", force=(0.0, 800.0, 0.0), duration=0.5).success
    tilts, wheels = watched(world, 2.5)
    lies = int(np.flatnonzero(tilts < LIMIT).max()) + 1  # from here on for ever
    moves = int(np.flatnonzero(wheels > 0.05).max())
    assert 0.3 < 0.001 * lies < 2.0 and wheels[:300].min() > 1.9  # it is driven until it tips
    assert 0.001 * (moves - lies) < 0.55
    assert plugin.life is PluginState.STARTING and set(owners(world).values()) == {""}
    level, summary = plugin.health()
    assert level == 2 and "the robot has fallen: its base is tilted by" in summary
    assert world.bus.reports["lower_level"].level == 2
    assert len(logged(caplog, "the robot has fallen")) == 1
    late = world.bus.call("joint_states/trajectory", joints=("j_wheel_1",), velocities=(1.0,))
    command(world, "stranger", "velocity_controller", ("j_wheel_1",), velocity=[3.0])
    world.run(0.3)
    for part in ("waits for its joints", "the robot has fallen", "a robot that stands upright"):
        assert part in str(late.exception(0))
    assert np.abs(speeds(world)).max() < 0.05
    assert world.ask("simulator/reset").success
    before = joints(world)
    world.run(1.0)
    assert plugin.life is PluginState.RUNNING and plugin.health() == (0, "running")
    assert np.abs(joints(world) - before).max() < TOLERANCE and np.abs(speeds(world)).max() < 0.1
    moves_again(world)


def test_a_wheel_that_is_spun_ends_all_commands(world, caplog):
    plugin = drive(world)
    assert world.ask("simulator/push", link="wheel_1", torque=(0.0, 60.0, 0.0), duration=0.2).success  # of 35 Nm
    world.run(0.1)
    assert plugin.life is PluginState.STARTING and "joint 'j_wheel_1' moved at" in plugin.health()[1]
    assert len(logged(caplog, "beyond 2 times its limit of 20")) == 1
    assert np.abs(speeds(world)[1:]).max() < 0.05
    world.run(1.0)
    assert plugin.life is PluginState.RUNNING and np.abs(speeds(world)).max() < 0.05
    moves_again(world)


@pytest.mark.parametrize(
    ("slope", "state", "height", "speed"),
    [
        (0.5, None, 0.0, 20.0),  # as fast as wheels can on a slope on which they nearly slip
        (0.0, "narrow", 0.2, 0.0),  # of all states that in which a drop makes joints the fastest: 3.3 times the limit
    ],
)
def test_what_is_rough_but_honest_is_no_reason(tmp_path, slope, state, height, speed):
    """A fast slope and a hard drop reach the joints' velocity limits; the safeguard must not take that for a fall."""
    file = tmp_path / "world.yaml"
    file.write_text(f"ground: {{slope: {slope}}}\n")
    simulation = Simulation.from_file(ROBOT / "robot.yaml", world=file)
    try:
        simulation.reset(state, StartPlacement(height=height))
        lower_level, fastest = simulation.lower_level, 0.0
        wheels = lower_level.controllers["velocity_controller"].joints
        for step in range(1500):
            if step % 5 == 0:
                forward = speed * np.array((1.0, -1.0, 1.0, -1.0))
                lower_level.accept("velocity_controller", JointMessage(wheels, velocity=forward, sender="driver"))
            simulation.step()
            fastest = max(fastest, float(np.max(np.abs(simulation.v) / simulation.kinematics.velocity_limit)))
            assert not lower_level.safeguard.reason
        assert fastest > 0.99
    finally:
        simulation.close()

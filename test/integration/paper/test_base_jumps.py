"""Fig. 5 with an estimate of the base that jumps: the robot does not."""

import math
from contextlib import closing

import numpy as np
import pytest
from breaking.sensors import in_a_copy
from support.paper.full_control import Nodes

from solfer.components.odometry.messages import stamped_pose
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState
from solfer.transport.messages import FieldsMessage

BEFORE, AFTER, PERIOD = 0.5, 1.0, 0.02
"""Time before the estimate jumps, after that, and between two velocities that are sent [s]."""

MOTIONS = {"stands": (0.0, 0.0), "drives": (0.2, 0.0), "turns": (0.1, 0.3)}
"""Velocities of the base, ahead and about z [m/s, rad/s]."""


def drawn(seed):
    """Draw where the base is taken to be all of a sudden: x, y, z [m] and heading [rad]."""
    draw = np.random.default_rng(seed)
    return (*draw.uniform(-6.0, 6.0, 2), 0.0, draw.uniform(-math.pi, math.pi))


JUMPS = {"place": (5.0, -3.0, 0.0, None), "heading": (None, None, 0.0, 2.0), **{f"{k}": drawn(k) for k in range(8)}}


class JumpingDrive:
    """Sends velocities of the base to a world of Fig. 5, and notes where it truly is."""

    def __init__(self, world, motion):
        self.world, self.motion = world, motion
        self.writer = MemoryMiddleware(world.bus, "stick").writer("locomotion/cmd_vel", "geometry_msgs/Twist")
        self.rows, self.fastest = [], 0.0
        self.limits = world.simulation.kinematics.velocity_limit[6:]
        world.run(1.5)
        world.bus.every(0.002, self.look)

    def look(self):
        """Note the largest share of its speed limit that a joint has."""
        self.fastest = max(self.fastest, float((np.abs(self.world.simulation.v[6:]) / self.limits).max()))

    def drive(self, duration):
        """Drive for a time [s]."""
        speed, rate = self.motion
        linear, angular = {"x": speed, "y": 0.0, "z": 0.0}, {"x": 0.0, "y": 0.0, "z": rate}
        for _ in range(round(duration / PERIOD)):
            if speed:
                self.writer.write(FieldsMessage({"linear": linear, "angular": angular}))
            self.world.run(PERIOD)
            now = self.world.simulation.state.now
            rotation = now.rotation("pelvis")
            heading, tilt = math.atan2(rotation[1, 0], rotation[0, 0]), math.acos(min(1.0, rotation[2, 2]))
            self.rows.append((*now.position("pelvis"), heading, tilt))


def goes_on(driver, jump=None):
    """Let the estimate jump if `jump` is given, and drive on; return the way, the fastest joint and jumps by plugin."""
    plugins = driver.world.plugins
    if jump is not None:
        odometry = plugins["odometry"].component
        x, y, _, heading = jump
        x, y = (odometry._position[:2].tolist()) if x is None else (x, y)
        heading = odometry.law.heading if heading is None else heading
        turn = np.array((0.0, 0.0, math.sin(0.5 * heading), math.cos(0.5 * heading)))
        odometry.set_pose(stamped_pose("odom", np.array((x, y, 0.0)), turn, 1e-4 * np.eye(6)))
    driver.drive(AFTER)
    assert {plugin.life for plugin in plugins.values()} == {PluginState.RUNNING}
    jumps = {name: plugin.figures().get("jumps of the base") for name, plugin in plugins.items()}
    return np.array(driver.rows), driver.fastest, jumps


@pytest.mark.daily(2)
@pytest.mark.parametrize("jump", JUMPS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_jump_of_the_estimate_moves_nothing(tmp_path, motion, jump):
    """The true path is what it is without a jump."""
    with closing(Nodes(tmp_path)) as world:
        driver = JumpingDrive(world, MOTIONS[motion])
        driver.drive(BEFORE)
        undisturbed, usual, _ = in_a_copy(lambda: goes_on(driver))
        jumped, fastest, jumps = goes_on(driver, JUMPS[jump])
    away = jumped - undisturbed
    print(motion, jump, np.abs(away).max(axis=0), fastest, usual, jumps)
    assert np.abs(away[:, :3]).max() < 0.005
    assert np.abs(away[:, 3:]).max() < 0.01
    assert fastest < max(1.1 * usual, 0.05)
    assert jumps["locomotion"] == 1

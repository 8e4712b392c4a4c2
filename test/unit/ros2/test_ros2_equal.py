"""A plugin on `middleware: ROS2` sends the commands that it sends in memory; needs the environment of `./run ros2`."""

import os
import time
from contextlib import closing

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ./run ros2")

from support.integration.world import STEP, World, parameters  # noqa: E402

from solfer.components.joint_states import MoveJoints  # noqa: E402
from solfer.middleware.ros2 import Ros2Middleware, Ros2Node  # noqa: E402
from solfer.middleware.ros2.node import Ros2Clock  # noqa: E402

START = 1.0 + STEP / 2.0
"""First cycle of the plugin [s]."""

BEGIN = 3.0 + STEP / 2.0
"""When the robot may move [s]; until then it stands still, and the plugin starts."""

MOTIONS = (
    MoveJoints(joints=("neck_pitch", "torso_yaw"), positions=(0.2, -0.4)),
    MoveJoints(joints=("j_wheel_1", "j_wheel_2"), velocities=(1.0, -1.0)),
    MoveJoints(state="reset"),
)
DISCOVERY = 1.5
"""Time in which nodes of this process find each other [s]."""

BETWEEN = 0.8
"""Time from one request to the next [s]."""


class VirtualClock(Ros2Clock):
    """Time of a bus."""

    def __init__(self, bus):
        self._bus = bus

    def now(self):
        """See `Ros2Clock.now`."""
        return self._bus.time

    def present(self):
        """See `Ros2Clock.present`."""
        return round(1e9 * self._bus.time)

    def stamp_of(self, measured):
        """See `Ros2Clock.stamp_of`."""
        return round(1e9 * measured)


class SteppedMiddleware(Ros2Middleware):
    """Lets the time of a bus pass while its node waits."""

    bus = None

    def running(self):
        """See `Middleware.running`."""
        if self.bus is not None:
            self.bus.run_until(self.bus.time + STEP)
        return super().running()


class Ros2World(World):
    """The simulated CENTAURO and plugins as nodes of ROS 2 in this process, on the virtual clock."""

    def offer(self, _):
        """See `World.offer`."""
        self._nodes = []
        middleware = self.connect("simulator")
        for name, text in parameters().items():
            middleware.provide(name, text)
        return super().offer(middleware)

    def connect(self, name):
        """See `World.connect`."""
        node = Ros2Node(name, ["test"])
        node.clock = VirtualClock(self.bus)
        self._nodes.append(SteppedMiddleware(node))
        self._nodes[-1].bus = None if name == "simulator" else self.bus
        time.sleep(DISCOVERY)
        return self._nodes[-1]

    def plugin(self, name):
        """See `World.plugin`; returns as soon as all nodes know all topics."""
        plugin = super().plugin(name)
        for each in self._nodes:
            each.bus = None
        time.sleep(DISCOVERY)
        return plugin

    def close(self):
        """See `World.close`."""
        for each in self._nodes:
            each.close()
        super().close()


def commands(world):
    """Let a robot move; return the commands of each cycle, and where the robot is at the end."""
    sent = []
    world._server.pause(True)
    world.asleep.add("joint_states")  # until both have been made, each in its own time
    plugin = world.plugin("joint_states")
    assert world.bus.time < START
    world.bus.every(1.0 / plugin.rate, plugin.cycle, START, cycles=True)
    while world.bus.time < BEGIN - STEP:  # claims travel in real time
        world.run(10 * STEP)
        time.sleep(0.001)
    world.bus.run_until(BEGIN)
    assert plugin.life.name == "RUNNING"
    world._server.pause(False)
    pipes = [pipe for pipe, _ in plugin.outputs.controllers]
    world.bus.every(
        1.0 / plugin.rate,
        lambda: sent.append(np.concatenate([each for pipe in pipes for each in numbers_of(pipe.sent)])),
        BEGIN + STEP,
    )
    for motion in MOTIONS:
        plugin.component.trajectory(motion)
        world.run(BETWEEN)
    return np.array(sent), world.simulation.q.copy()


def numbers_of(state):
    """Return the arrays of what was sent."""
    fields = (getattr(state, name, None) for name in ("position", "velocity", "effort"))
    return [each for each in fields if each is not None]


@pytest.mark.soak
def test_commands_equal_those_in_memory(monkeypatch):
    """Packed and unpacked by DDS, the measurements and commands of each cycle are the same to 1e-9."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    with closing(World()) as memory, closing(Ros2World()) as ros2:
        expected, place = commands(memory)
        found, end = commands(ros2)
    assert len(expected) == len(found) > 400 and np.ptp(expected, axis=0).max() > 0.3
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(end, place, rtol=0.0, atol=1e-9)

"""The RT layer in its steady loop keeps no memory: neither Python's nor that of the libraries below."""

import contextlib
import gc
import re
from pathlib import Path

import numpy as np
from support.allocations import CYCLES, check_that_it_keeps_no_memory
from support.integration.world import CONFIG, STEP
from support.integration.xbot_world import XbotWorld
from support.plugins.plugin import WHEELS

from solfer.components.move_joints import MoveJoints
from solfer.config import load
from solfer.plugins import PluginState, Registry, generate
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorRules, ExecutorTelemetry
from solfer.telemetry.black_box import BlackBox
from solfer.transport import JointMessage

PLUGIN, JOINT_STATE, SIMULATOR = "joint_states", "sensor_msgs/JointState", "simulator"
GROWTH = 2_000_000
"""What all cycles together may keep beyond Python's objects: less than a number in each [B]."""


class MovingRobot(XbotWorld):
    """A robot that moves; after `replace` without the simulation, which allocates and frees memory itself."""

    def replace(self) -> None:
        """Let another node of the same name publish the joint states from now on."""
        names, time = self.simulation.body.joints, self.bus.time
        self._node.close()
        self._published = JointMessage.empty(names, ("position", "velocity", "effort"))
        self._rates = np.array([1.5 * (name in WHEELS) for name in names])  # wheels follow
        self._position = self.simulation.q[6:] - self._rates * time + 0.01 * np.cos(time)  # no joint leaps
        self._writer = self.node(SIMULATOR).writer("joint_states", JOINT_STATE)

    def _step(self) -> None:
        if not hasattr(self, "_writer"):
            super()._step()
            return
        self._published.stamp = self.bus.time
        time, rates = self.bus.time, self._rates
        self._published.velocity[:] = rates + 0.01 * np.sin(time)
        self._published.position[:] = self._position + rates * time - 0.01 * np.cos(time)
        self._writer.write(self._published)


@contextlib.contextmanager
def switched_off():
    """Without the garbage collector, which is off in the loop: what refers to itself stays, too."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def anonymous_memory() -> int:
    """Memory of this process that is in no file [B]."""
    return 1024 * int(re.search(r"RssAnon:\s+(\d+)", Path("/proc/self/status").read_text())[1])


def test_ten_thousand_moving_cycles_keep_no_memory(tmp_path):
    """A leak of any size would page-fault the loop in the end: neither Python nor malloc may grow while wheels turn."""
    robot = MovingRobot(tmp_path)
    node, configuration = robot.node(PLUGIN), load(CONFIG / "centauro.yaml", PLUGIN, middleware="XBOT", layer="RT")
    plugin = generate(configuration, node, Registry().find(PLUGIN))
    rules = ExecutorRules(blend=0.1, budget=1.0, overruns=10**9)
    executor = Executor(
        [plugin],
        robot.node("xbot"),
        EmergencyStopLatch(tmp_path),
        rules=rules,
        polls=[node.poll],
        telemetry=ExecutorTelemetry(black_box=BlackBox(tmp_path, [plugin], 1.0)),
    )
    robot.bus.every(1.0 / executor.rate, executor.cycle)
    executor.switchboard.commit(executor.switchboard.plan(start=[PLUGIN]))
    robot.run(0.5)
    plugin.component.trajectory(MoveJoints(joints=WHEELS, velocities=(0.5,) * 4))
    robot.run(0.5)
    robot.replace()
    period, taken = 1.0 / executor.rate, plugin.feedbacks[0].accepted
    assert period >= 2 * STEP  # each cycle brings news
    with switched_off():
        check_that_it_keeps_no_memory(lambda: robot.run(period))
    before = anonymous_memory()
    for _ in range(CYCLES):
        robot.run(period)
    assert anonymous_memory() - before < GROWTH
    assert executor.plugins[0].state is PluginState.RUNNING and plugin.robot.command.velocity.any()
    assert plugin.feedbacks[0].accepted - taken >= 2 * CYCLES
    robot.close()

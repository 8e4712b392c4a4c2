"""The RT layer in its steady loop keeps no memory: neither Python's nor that of the libraries below."""

import contextlib
import gc
import re
from pathlib import Path

import numpy as np
from allocations import CYCLES, check_that_it_keeps_no_memory
from test_plugin import WHEELS
from world import CONFIG, STEP
from xbot_world import XbotWorld

from solfer.components.move_joints import MoveJoints
from solfer.config import load
from solfer.middleware.xbot.black_box import BlackBox
from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.executor import Executor, Rules
from solfer.middleware.xbot.lifecycle import Stage
from solfer.pipes import JointMessage
from solfer.plugins import Registry, generate

PLUGIN, JOINT_STATE, SIMULATOR = "joint_states", "sensor_msgs/JointState", "simulator"
GROWTH = 2_000_000
"""What all cycles together may keep beyond Python's objects: less than a number in each [B]."""


class Robot(XbotWorld):
    """A robot that moves and tells it; after `replace` without the simulation, which takes and frees memory itself."""

    def replace(self) -> None:
        """Another node of the same name tells where the joints are from now on."""
        names, self._position = self.simulation.joint_message().names, self.simulation.joint_message().position.copy()
        self._node.close()
        self._told = JointMessage.empty(names, ("position", "velocity", "effort"))
        self._writer = self.node(SIMULATOR).writer("joint_states", JOINT_STATE)

    def _step(self) -> None:
        if not hasattr(self, "_writer"):
            super()._step()
            return
        self._told.stamp = self.bus.time
        np.sin(self._position + self.bus.time, out=self._told.velocity)
        np.add(self._position, 1e-3 * self.bus.time, out=self._told.position)
        self._writer.write(self._told)


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


def test_ten_thousand_cycles_of_a_plugin_that_moves_keep_no_memory(tmp_path):
    robot = Robot(tmp_path)
    node, configuration = robot.node(PLUGIN), load(CONFIG / "centauro.yaml", PLUGIN, middleware="XBOT", layer="RT")
    plugin = generate(configuration, node, Registry().find(PLUGIN))
    rules = Rules(blend=0.1, budget=1.0, overruns=10**9)
    executor = Executor([plugin], robot.node("xbot"), EmergencyStop(tmp_path), rules=rules, polls=[node.poll],
                        black_box=BlackBox(tmp_path, [plugin], 1.0))
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
    assert executor.plugins[0].stage is Stage.RUNNING and plugin.robot.command.velocity.any()
    assert plugin.feedbacks[0].accepted - taken >= 2 * CYCLES
    robot.close()

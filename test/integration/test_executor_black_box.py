"""What the executor records, cycle by cycle, against what was told and commanded in the same cycles."""

from contextlib import closing

import numpy as np
import pytest
from test_plugin import WHEELS
from world import CONFIG

from solfer.components.move_joints import MoveJoints
from solfer.config import load
from solfer.errors import MiddlewareError
from solfer.middleware.memory import MemoryMiddleware
from solfer.middleware.xbot.black_box import BlackBox
from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.executor import Executor, Rules
from solfer.middleware.xbot.lifecycle import Stage
from solfer.middleware.xbot.recording import Recording
from solfer.plugins import Registry, generate

PLUGIN, SPEED = "joint_states", 1.5
COMMANDS = {"position_controller": "position", "velocity_controller": "velocity"}


@pytest.fixture
def plugin(world):
    return generate(load(CONFIG / "centauro.yaml", PLUGIN), MemoryMiddleware(world.bus, PLUGIN), Registry().find(PLUGIN))


@pytest.fixture
def executor(world, plugin, tmp_path):
    made = Executor([plugin], MemoryMiddleware(world.bus, "xbot"), EmergencyStop(tmp_path), rules=Rules(blend=0.2),
                    nanoseconds=lambda: round(1e9 * world.bus.time), black_box=BlackBox(tmp_path, [plugin]))
    world.bus.every(1.0 / made.rate, made.cycle)
    return made


def recorded(folder):
    """All that was recorded so far, and its labels."""
    with closing(Recording(folder)) as recording:
        recording.drain()
        assert recording.lost == 0
        return {name: np.array(values) for name, values in recording.arrays().items()}, recording.labels


def test_each_cycle_holds_what_was_heard_wanted_and_commanded_in_it(world, executor, plugin, tmp_path):
    ear = MemoryMiddleware(world.bus, "ear")
    queues = {name: ear.queue(f"{name}/command", "solfer/JointCommand", 4096) for name in COMMANDS}
    told = ear.queue("joint_states", "sensor_msgs/JointState", 4096)
    board = executor.switchboard
    world.run(0.05)
    board.commit(board.plan(start=[PLUGIN]))
    world.run(0.5)
    plugin.component.trajectory(MoveJoints("mammal_wide_high"))
    plugin.component.trajectory(MoveJoints(joints=WHEELS, velocities=(SPEED,) * 4))
    world.run(1.0)
    executor.plugins[0].abort("for a test")
    world.run(0.05)
    found, labels = recorded(tmp_path)
    stages = found["stages"][:, 0].astype(int)
    assert [Stage(stage) for stage in stages[np.flatnonzero(np.diff(stages, prepend=-1))]] == [
        Stage.INITIALIZED, Stage.STARTING, Stage.RUNNING, Stage.ABORTED]
    np.testing.assert_allclose(np.diff(found["time"]), 1.0 / executor.rate)
    for controller, field in COMMANDS.items():
        sent = {round(message.stamp, 6): message for message in queues[controller].drain()}
        cycles = [row for row, time in enumerate(found["time"])
                  if round(time, 6) in sent and stages[row] != Stage.ABORTED]
        assert len(cycles) > 200
        for row in cycles:
            message = sent[round(found["time"][row], 6)]
            assert tuple(labels[f"{PLUGIN}.sent.{controller}.joints"]) == message.names
            np.testing.assert_array_equal(found[f"{PLUGIN}.sent.{controller}.{field}"][row], getattr(message, field))
    heard = told.drain()
    joints = [labels[f"{PLUGIN}.dofs"].index(name) for name in heard[0].names]
    known = {message.position.tobytes() for message in heard}
    measured = found[f"{PLUGIN}.measured.position"][stages == Stage.RUNNING][:, joints]
    assert all(row.tobytes() in known for row in measured) and np.ptp(measured, axis=0).max() > 0.3
    wheels = [labels[f"{PLUGIN}.dofs"].index(name) for name in WHEELS]
    wanted = found[f"{PLUGIN}.desired.velocity"][:, wheels]
    np.testing.assert_array_equal(wanted[stages == Stage.RUNNING][-1], SPEED)
    np.testing.assert_array_equal(wanted[-1], 0.0)  # it holds


def test_how_late_a_cycle_was_and_how_long_it_took_are_seconds(world, executor, plugin, tmp_path):
    plugin.inbox.apply = lambda: setattr(world.bus, "time", world.bus.time + 0.001)
    executor.cycle(late=3_000_000)
    found, labels = recorded(tmp_path)
    assert found["lateness"].tolist() == [pytest.approx(0.003)] and found["duration"].tolist() == [pytest.approx(0.001)]
    assert labels["plugins"] == [PLUGIN]


def test_without_room_there_is_no_black_box_and_the_reason_is_told(plugin, tmp_path):
    with pytest.raises(MiddlewareError, match="shared memory cannot be made"):
        BlackBox(tmp_path, [plugin], 1e12)

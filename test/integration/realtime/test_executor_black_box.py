"""What the executor records, cycle by cycle, against what was published and commanded in the same cycles."""

from contextlib import closing

import numpy as np
import pytest
from support.integration.world import CONFIG
from support.plugins.plugin import WHEELS

from solfer.components.move_joints import MoveJoints
from solfer.config import load
from solfer.errors import MiddlewareError
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import Registry, generate
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorRules
from solfer.realtime.lifecycle import PluginState
from solfer.realtime.telemetry.black_box import BlackBox
from solfer.realtime.telemetry.recording import Recording

PLUGIN, SPEED = "joint_states", 1.5
COMMANDS = {"position_controller": "position", "velocity_controller": "velocity"}


@pytest.fixture
def plugin(world):
    settings = load(CONFIG / "centauro.yaml", PLUGIN)
    return generate(settings, MemoryMiddleware(world.bus, PLUGIN), Registry().find(PLUGIN))


@pytest.fixture
def executor(world, plugin, tmp_path):
    made = Executor(
        [plugin],
        MemoryMiddleware(world.bus, "xbot"),
        EmergencyStopLatch(tmp_path),
        rules=ExecutorRules(blend=0.2),
        nanoseconds=lambda: round(1e9 * world.bus.time),
        black_box=BlackBox(tmp_path, [plugin]),
    )
    world.bus.every(1.0 / made.rate, made.cycle)
    return made


def recorded(folder):
    """All that was recorded so far, and its labels."""
    with closing(Recording(folder)) as recording:
        recording.drain()
        assert recording.lost == 0
        return {name: np.array(values) for name, values in recording.arrays().items()}, recording.labels


def test_each_cycle_is_recorded_whole(world, executor, plugin, tmp_path):
    ear = MemoryMiddleware(world.bus, "ear")
    queues = {name: ear.queue(f"{name}/command", "solfer/JointCommand", 4096) for name in COMMANDS}
    published = ear.queue("joint_states", "sensor_msgs/JointState", 4096)
    statistics = executor.switchboard
    world.run(0.05)
    statistics.commit(statistics.plan(start=[PLUGIN]))
    world.run(0.5)
    plugin.component.trajectory(MoveJoints("mammal_wide_high"))
    plugin.component.trajectory(MoveJoints(joints=WHEELS, velocities=(SPEED,) * 4))
    world.run(1.0)
    executor.plugins[0].abort("for a test")
    world.run(0.05)
    found, labels = recorded(tmp_path)
    stages = found["stages"][:, 0].astype(int)
    assert [PluginState(stage) for stage in stages[np.flatnonzero(np.diff(stages, prepend=-1))]] == [
        PluginState.INITIALIZED,
        PluginState.STARTING,
        PluginState.RUNNING,
        PluginState.ABORTED,
    ]
    np.testing.assert_allclose(np.diff(found["time"]), 1.0 / executor.rate)
    for controller, field in COMMANDS.items():
        sent = {round(message.stamp, 6): message for message in queues[controller].drain()}
        cycles = [
            row
            for row, time in enumerate(found["time"])
            if round(time, 6) in sent and stages[row] != PluginState.ABORTED
        ]
        assert len(cycles) > 200
        for row in cycles:
            message = sent[round(found["time"][row], 6)]
            assert tuple(labels[f"{PLUGIN}.sent.{controller}.joints"]) == message.names
            np.testing.assert_array_equal(found[f"{PLUGIN}.sent.{controller}.{field}"][row], getattr(message, field))
    received = published.drain()
    joints = [labels[f"{PLUGIN}.dofs"].index(name) for name in received[0].names]
    known = {message.position.tobytes() for message in received}
    measured = found[f"{PLUGIN}.measured.position"][stages == PluginState.RUNNING][:, joints]
    assert all(row.tobytes() in known for row in measured) and np.ptp(measured, axis=0).max() > 0.3
    wheels = [labels[f"{PLUGIN}.dofs"].index(name) for name in WHEELS]
    wanted = found[f"{PLUGIN}.desired.velocity"][:, wheels]
    np.testing.assert_array_equal(wanted[stages == PluginState.RUNNING][-1], SPEED)
    np.testing.assert_array_equal(wanted[-1], 0.0)  # it holds


def test_lateness_and_duration_are_recorded_in_seconds(world, executor, plugin, tmp_path):
    plugin.inbox.apply = lambda: setattr(world.bus, "time", world.bus.time + 0.001)
    executor.cycle(late=3_000_000)
    found, labels = recorded(tmp_path)
    assert found["lateness"].tolist() == [pytest.approx(0.003)] and found["duration"].tolist() == [pytest.approx(0.001)]
    assert labels["plugins"] == [PLUGIN]


def test_without_room_no_black_box_is_made(plugin, tmp_path):
    with pytest.raises(MiddlewareError, match="shared memory cannot be made"):
        BlackBox(tmp_path, [plugin], 1e12)

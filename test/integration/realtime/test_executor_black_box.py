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
from solfer.plugins import PluginState, Registry, generate
from solfer.plugins.timing.cycle_timing import STAGES
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorRules, ExecutorTelemetry
from solfer.recording.reader import read
from solfer.recording.writer import RecordingWriter
from solfer.telemetry.black_box import BlackBox
from solfer.telemetry.drain import RecordDrain

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
        telemetry=ExecutorTelemetry(
            nanoseconds=lambda: round(1e9 * world.bus.time), black_box=BlackBox(tmp_path, [plugin])
        ),
    )
    world.bus.every(1.0 / made.rate, made.cycle)
    return made


def recorded(folder):
    """Return all that was recorded so far, from a file."""
    drain = RecordDrain(folder)
    files = {name: text.encode() for name, text in drain.layout.attachments.items()}
    with closing(RecordingWriter(folder / "run.mcap", files)) as writer:
        drain.into(writer).fill()
        writer.finish(drain.lost)
    found = read(folder / "run.mcap")
    assert found.lost == 0 and not found.missing
    return found


def test_each_cycle_is_recorded_whole(world, executor, plugin, tmp_path):
    """Received messages are the oracle: measured, desired and commanded values belong to the same cycle.

    The states and events of the plugin follow its life up to the abort.
    """
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
    found = recorded(tmp_path)
    stages, times = found["loop/states"].column(PLUGIN).astype(int), found["loop/states"].times
    assert [PluginState(stage) for stage in stages[np.flatnonzero(np.diff(stages, prepend=-1))]] == [
        PluginState.INITIALIZED,
        PluginState.STARTING,
        PluginState.RUNNING,
        PluginState.ABORTED,
    ]
    np.testing.assert_allclose(np.diff(times), 1.0 / executor.rate)
    for controller, field in COMMANDS.items():
        sent = {round(message.stamp, 6): message for message in queues[controller].drain()}
        cycles = [
            row for row, time in enumerate(times) if round(time, 6) in sent and stages[row] != PluginState.ABORTED
        ]
        assert len(cycles) > 200
        for row in cycles:
            message = sent[round(times[row], 6)]
            assert found[f"{PLUGIN}/command/{controller}/{field}"].columns == message.names
            values = found[f"{PLUGIN}/command/{controller}/{field}"].values[row]
            np.testing.assert_array_equal(values, getattr(message, field))
    received = published.drain()
    dofs = found[f"{PLUGIN}/measured/position"].columns
    joints = [dofs.index(name) for name in received[0].names]
    known = {message.position.tobytes() for message in received}
    measured = found[f"{PLUGIN}/measured/position"].values[stages == PluginState.RUNNING][:, joints]
    assert all(row.tobytes() in known for row in measured) and np.ptp(measured, axis=0).max() > 0.3
    wheels = [dofs.index(name) for name in WHEELS]
    desired = found[f"{PLUGIN}/wanted/velocity"].values[:, wheels]
    np.testing.assert_array_equal(desired[stages == PluginState.RUNNING][-1], SPEED)
    np.testing.assert_array_equal(desired[-1], 0.0)  # it holds
    assert [(each.plugin, each.kind) for each in found.events] == [
        (PLUGIN, "initialized"),
        (PLUGIN, "start"),
        (PLUGIN, "run"),
        (PLUGIN, "claim"),
        (PLUGIN, "abort"),
        (PLUGIN, "release"),
    ]
    abort = next(each for each in found.events if each.kind == "abort")
    assert abort.text == "for a test" and abort.time == pytest.approx(times[-1], abs=0.06)
    check_the_rest(found, stages == PluginState.RUNNING)


def check_the_rest(found, running):
    """Check what is recorded beside States and commands, and what the component declares."""
    pipe = f"{PLUGIN}/feedback/link_side_online" if f"{PLUGIN}/feedback/link_side_online/age" in found.channels else ""
    pipe = pipe or next(name for name in found.channels if name.endswith("/age")).removesuffix("/age")
    position = found[f"{pipe}/position"]
    dofs = found[f"{PLUGIN}/measured/position"].columns
    places = [dofs.index(name) for name in position.columns]
    measured = found[f"{PLUGIN}/measured/position"].values[:, places]
    np.testing.assert_array_equal(position.values[running], measured[running])
    assert (found[f"{pipe}/age"].values[running] <= 0.01).all() and set(position.units) == {"rad"}
    assert found[f"{PLUGIN}/gate"].columns[0] == "position_controller not finite"
    ramp, desired = found[f"{PLUGIN}/log/ramp/position"], found[f"{PLUGIN}/wanted/position"]
    inner = [desired.columns.index(name) for name in ramp.columns]
    np.testing.assert_array_equal(ramp.values[running], desired.values[running][:, inner])
    assert found[f"{PLUGIN}/timing"].columns == STAGES
    assert set(found.attachments) == {f"{PLUGIN}/{name}" for name in ("configuration.yaml", "robot.urdf", "robot.srdf")}
    assert b"position_controller" in found.attachments[f"{PLUGIN}/configuration.yaml"]


def test_lateness_and_duration_are_recorded_in_seconds(world, executor, plugin, tmp_path):
    plugin.inbox.apply = lambda: setattr(world.bus, "time", world.bus.time + 0.001)
    executor.cycle(late=3_000_000)
    found = recorded(tmp_path)
    assert found["loop/timing"].columns == ("lateness", "duration")
    assert found["loop/timing"].values.tolist() == [[pytest.approx(0.003), pytest.approx(0.001)]]
    assert found["loop/states"].columns == (PLUGIN,)


def test_without_room_no_black_box_is_made(plugin, tmp_path):
    with pytest.raises(MiddlewareError, match="shared memory cannot be made"):
        BlackBox(tmp_path, [plugin], 1e12)

"""The story of the demonstration on the virtual clock: the robot does what is commanded, and the figures show it."""

import numpy as np
import pytest

from solfer.middleware.memory import MemoryMiddleware
from solfer_tools.demo import centauro, report, story
from solfer_tools.demo.record import MotionRecorder


@pytest.fixture
def storyteller(world):
    for name in ("upper_body", "lower_body", "whole_body"):
        world.plugin(name)
    middleware = MemoryMiddleware(world.bus, "demo")
    recorder = MotionRecorder(middleware)
    return story.StoryTeller(middleware, recorder, lambda title, passed, duration: None), recorder, middleware


def test_the_robot_drives_and_the_plots_show_it(storyteller, world, tmp_path):
    """There and back within 1 cm, from the wheels' radius alone; the table's joint errors stay small."""
    storyteller, recorder, middleware = storyteller
    storyteller.wait_for_robot(10.0)
    robot = centauro.load_robot(middleware)
    forward, radius = centauro.wheels(robot, recorder)
    assert forward == {"j_wheel_1": 1.0, "j_wheel_2": -1.0, "j_wheel_3": 1.0, "j_wheel_4": -1.0}
    assert radius == pytest.approx(0.078, abs=1e-3)
    goal = {"torso_yaw": 0.4, "j_arm1_4": -1.6, "j_arm2_4": -1.6}
    for step in (*story.raised("mammal_wide_high", goal), *story.posture("mammal_wide_straight")):
        storyteller.publish(step)
    start = recorder.newest("base").position.copy()
    for step in story.drive(0.2, radius, forward):
        storyteller.publish(step)
    there = recorder.newest("base").position.copy()
    for step in story.drive(-0.2, radius, forward):
        storyteller.publish(step)
    assert np.abs(there - start - (0.2, 0.0, 0.0)).max() < 0.01
    assert np.abs(recorder.newest("base").position - start).max() < 0.01
    parts = centauro.parts(robot)
    rows = dict(report.table(recorder, {**parts, "nothing": ()}, {}, "whole_body", "simulation"))
    assert "largest joint error, nothing" not in rows
    for part in ("upper body", "lower body"):
        error, joint = rows[f"largest joint error, {part}"].split(" rad ")
        assert 0.0 < float(error) < 0.06 and joint.strip("()") in parts[part]
    assert rows["real-time factor"] == "not reported"
    path = tmp_path / "plot.png"
    report.plot(recorder, ("torso_yaw", "hip_pitch_1"), tuple(forward), path)
    assert path.stat().st_size > 20_000

"""MoveIt's Panda: its SRDF, and a trajectory as its planners write them, on the simulated robot."""

from contextlib import closing
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pytest

from solfer import Robot
from solfer.config import load
from solfer.interfaces.trajectories import (
    FOLLOW,
    SUCCESSFUL,
    FollowFeedback,
    FollowGoal,
    FollowResult,
    JointTolerance,
    JointTrajectory,
    TrajectoryPoint,
)
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Registry, generate
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.server.publications import robot_parameters
from solfer.transport.declared import ActionClient, GoalStatus
from solfer_tools.cli.skeletons.robot import RobotSkeleton

ROBOTS = distribution("example-robot-data").locate_file("cmeel.prefix/share/example-robot-data/robots")
URDF = Path(str(ROBOTS), "panda_description/urdf/panda.urdf")
SRDF = Path(__file__).parents[2] / "data/moveit/panda.srdf"
JOINTS = tuple(f"panda_joint{number}" for number in (4, 1, 7, 2, 6, 3, 5))
"""In the order of a planner, which is not that of the URDF."""

READY = np.array((-2.356, 0.0, 0.785, -0.785, 1.571, 0.0, 0.0))
GOAL = np.array((-1.9, 0.6, 0.3, -0.4, 2.0, 0.2, -0.3))
BEND = np.array((0.2, -0.1, 0.1, 0.15, 0.0, 0.1, 0.2))
SPEED, ACCELERATION, EVERY = 0.4, 0.5, 0.1
"""Of the path's parameter [1/s, 1/s2], and from one point to the next [s]."""


def planned():
    """Make a trajectory along a bent path in the time of a trapezoidal speed, with a last point off the raster."""
    ramp = SPEED / ACCELERATION
    duration = ramp + 1.0 / SPEED
    points = []
    for time in (*np.arange(0.0, duration, EVERY), duration):
        if time < ramp:
            s, rate, change = 0.5 * ACCELERATION * time**2, ACCELERATION * time, ACCELERATION
        elif time < duration - ramp:
            s, rate, change = SPEED * (time - 0.5 * ramp), SPEED, 0.0
        else:
            left = duration - time
            s, rate, change = 1.0 - 0.5 * ACCELERATION * left**2, ACCELERATION * left, -ACCELERATION
        place = READY + s * (GOAL - READY) + np.sin(np.pi * s) * BEND
        slope = GOAL - READY + np.pi * np.cos(np.pi * s) * BEND
        bend = -(np.pi**2) * np.sin(np.pi * s) * BEND
        numbers = (place, slope * rate, bend * rate**2 + slope * change)
        points.append(TrajectoryPoint(*map(tuple, numbers), time_from_start=float(time)))
    return JointTrajectory(joint_names=JOINTS, points=tuple(points))


def test_its_srdf_is_read_whole(caplog):
    robot = Robot.load(URDF, SRDF, floating_base=False)
    arm = tuple(f"panda_joint{number}" for number in range(1, 8))
    assert robot.selectors["panda_arm"].names == arm
    fingers = ("panda_finger_joint1", "panda_finger_joint2")
    assert set(robot.selectors["panda_arm_hand"].names) == {*arm, *fingers}
    for state, count in (("ready", 7), ("extended", 7), ("open", 2), ("close", 2)):
        assert len(robot.named_state(state)[0]) == count
    (message,) = caplog.messages
    assert message.endswith("left out: group 'hand': unknown member <passive_joint>")


def test_a_planned_trajectory_is_followed(tmp_path):
    """The way of the simulated joints stays near the points of the planner, and the goal succeeds."""
    RobotSkeleton("panda", tmp_path / "panda", URDF, SRDF, False).write()
    config = tmp_path / "panda/config"
    bundle = read_bundle(config / "robots/panda/robot.yaml")
    with closing(Simulation.from_file(bundle)) as simulation:
        assert simulation.start == "ready"
        bus = Bus(robot_parameters(bundle))
        bus.every(0.001, SimulationServer(simulation, MemoryMiddleware(bus, "simulator")).cycle)
        node = MemoryMiddleware(bus, "joint_states")
        plugin = generate(load(config / "panda.yaml", "joint_states"), node, Registry().find("joint_states"))
        bus.every(1.0 / plugin.rate, plugin.cycle)
        name = "joint_states/follow_joint_trajectory"
        group = MemoryMiddleware(bus, "move_group")
        client = ActionClient(group, name, FOLLOW, FollowGoal, FollowFeedback, result=FollowResult)
        bus.every(0.02, client.poll)
        bus.run_until(1.0)
        trajectory = planned()
        on_the_way = tuple(JointTolerance(joint, position=0.1) for joint in JOINTS)
        at_the_end = tuple(JointTolerance(joint, position=0.02) for joint in JOINTS)
        goal = client.send(FollowGoal(trajectory, on_the_way, at_the_end, 1.0))
        bus.run_until(bus.time + 0.03)
        indices, begin, rows = [simulation.kinematics.dofs.index(joint) for joint in JOINTS], bus.time, []
        for point in trajectory.points:
            bus.run_until(begin + point.time_from_start)
            rows.append(simulation.q[indices].copy())
        bus.run_until(bus.time + 1.5)
        assert (goal.status, goal.result.error_code) == (GoalStatus.SUCCEEDED, SUCCESSFUL), goal.text
        planner = np.array([point.positions for point in trajectory.points])
        assert np.abs(rows - planner).max() < 0.03
        assert simulation.q[indices] == pytest.approx(GOAL, abs=0.02)

"""The robot of Fig. 5 is driven to way-points of a map, in which a localisation moves the odometry's frame."""

import math
from contextlib import closing

import numpy as np
import pytest
from breaking.sensors import in_a_copy
from support.paper.full_control import Nodes
from support.unit.correction import Correction

from solfer.middleware.memory import MemoryMiddleware
from solfer_tools.navigation import DriveLimits, Navigation, Waypoint, WaypointCourse, WaypointFollower

WAYPOINTS = Waypoint(2.2, 1.1), Waypoint(2.25, 1.25, 0.8)
"""In the map, where the robot stands at (2, 1) m, with a heading of 0.5 rad, as the localisation is on average."""

RATE = 50.0


def drive(world, seed, share):
    """Drive to the way-points while a share of the corrections of a seed counts.

    Returns:
        By how much the last way-point is missed [m, rad], by the mean of the localisation and the truth, and the
        largest speeds of joints as shares of their limits, wheels apart, shape (2,).
    """
    node, correction = MemoryMiddleware(world.bus, "navigation"), Correction(world.bus, seed)
    correction.drawn *= share
    course = WaypointCourse(node, WaypointFollower(WAYPOINTS, DriveLimits()), "locomotion", "odometry/odom", correction)
    navigation = Navigation(node, course, "navigation", RATE)
    simulation = world.simulation
    is_wheel = np.array(["wheel" in name for name in simulation.kinematics.dofs[6:]])
    limit = simulation.kinematics.velocity_limit[6:]
    begin = simulation.state.now.position("pelvis").copy()
    largest = np.zeros(len(limit))
    world.bus.every(0.002, lambda: np.maximum(largest, np.abs(simulation.v[6:]) / limit, out=largest))
    while not navigation.done:
        navigation.cycle()
        world.run(1.0 / RATE)
    now = simulation.state.now
    rotation = now.rotation("pelvis")
    x, y, _ = now.position("pelvis") - begin
    heading = math.atan2(rotation[1, 0], rotation[0, 0])
    pose = correction.mean_pose((x, y, heading))
    goal = WAYPOINTS[-1]
    away = math.dist(pose[:2], (goal.x, goal.y)), abs(pose[2] - goal.heading)
    return away, np.array((largest[~is_wheel].max(), largest[is_wheel].max()))


@pytest.mark.daily(1)
@pytest.mark.parametrize("seed", range(3))
def test_a_localisation_that_corrects_makes_no_joint_faster(seed):
    with closing(Nodes(None)) as world:
        world.run(1.5)
        usual, steady = in_a_copy(lambda: drive(world, seed, 0.0))
        (distance, turn), fastest = drive(world, seed, 1.0)
    # a correction of 0.1 m moves the goal by 20 mm within a second, the last one, too
    assert usual[0] < 0.02 and distance < 0.03 and turn < 0.03
    assert (fastest < 1.1 * steady + 0.02).all()

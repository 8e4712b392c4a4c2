"""Pipes of rigid bodies against the simulated CENTAURO: its base is received, and links are published."""

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from support.plugins.plugin import configuration

from solfer.errors import ConfigError, PipeError, SolferError, UnknownName

BODY = {"chain": "all", "type": "body", "name": "pelvis", "mapping": "RBDL"}
BASE = {
    "space": "OPERATIONAL",
    "dofs": BODY,
    "interface": {"position": True, "velocity": True},
    "source": "floating_base",
    "message": "gazebo_msgs::LinkStates",
    "reference": "centauro::pelvis",
    "initialize": True,
}
IMU = {
    "space": "OPERATIONAL",
    "dofs": BODY | {"name": "imu_link"},
    "source": "imu",
    "message": "sensor_msgs/Imu",
    "interface": {"position": True, "velocity": True},
    "convention": {"position": {"type": "NONE"}},
    "initialize": True,
}
PUBLISHED = {
    "space": "OPERATIONAL",
    "type": "reference",
    "function": "state",
    "dofs": BODY | {"name": "arm1_7"},
    "interface": {"position": True, "velocity": True},
    "sink": "hand",
    "message": "nav_msgs/Odometry",
}


def pipes(tmp_path, feedback=None, controller=None, **extra):
    """Write the shipped configuration with a module `test` that receives the joints and one more pipe, or sends."""
    tags = {"class": "support.plugins.body_pipes:Watcher", "kinematics": True, "robot": "watched", "controller": []}
    path = configuration(tmp_path, **tags)
    tree = yaml.safe_load(path.read_text())
    root = tree["mwoibn"]
    received = ["link_side_online"] + (["extra"] if feedback else [])
    root["modules"]["listener"] = root["modules"]["test"]
    root["robot"]["watched"] = {
        "feedback": {"list": received},
        "actuators": {"read": False},
        "contacts": {"read": False},
    }
    if feedback:
        root["feedback"]["extra"] = feedback | extra
    if controller:
        root["controller"]["extra"] = controller | extra
        root["modules"]["test"]["controller"] = ["extra"]
    path.write_text(yaml.safe_dump(tree))
    return path


class Past:
    """What the simulated robot really did, by time."""

    def __init__(self, world):
        self._world, self._moments = world, {}

    def watch(self, duration):
        """Let time pass while the robot is pushed and sways."""
        simulation = self._world.simulation
        simulation.pushes.add("pelvis", (150.0, 250.0, 0.0), (40.0, 30.0, 60.0), duration)
        for _ in range(round(duration / 0.001)):
            self._world.run(0.001)
            self._moments[round(simulation.time, 3)] = simulation.q.copy(), simulation.v.copy()

    def at(self, stamp):
        """Positions and velocities of all DoFs."""
        return self._moments[round(stamp, 3)]


def moved(world, path, name="test"):
    """Make a plugin, and find the robot's true pose at the newest message that it got by the pipe `extra`."""
    plugin, past = world.plugin(name, path), Past(world)
    world.run(0.1)
    past.watch(0.25)
    received = [feedback.reader.message for feedback in plugin.feedbacks if feedback.name == "extra"]
    return plugin, past.at(received[0].stamp)


def test_the_published_base_is_the_simulations(world, tmp_path):
    plugin, (q, v) = moved(world, pipes(tmp_path, BASE))
    assert np.abs(v[:6]).min() > 1e-4  # it moves in every direction
    assert_allclose(plugin.robot.state.position, q, atol=1e-9)
    assert_allclose(plugin.robot.state.velocity[:6], v[:6], atol=1e-9)
    # the origin of the URDF's floating joint is 0.93445 m above the world's
    height = plugin.robot.kinematics.position("pelvis")[2]
    assert height == pytest.approx(0.93445 + q[2], abs=1e-3)


def test_the_imu_gives_the_orientation(world, tmp_path):
    plugin, (q, v) = moved(world, pipes(tmp_path, IMU))
    assert_allclose(plugin.robot.state.position[3:6], q[3:6], atol=1e-9)
    assert_allclose(plugin.robot.state.velocity[3:6], v[3:6], atol=1e-9)
    assert not plugin.robot.state.position[:3].any()


@pytest.mark.parametrize("orientation", [{"order": "wxyz"}, {"convention": "JPL"}])
def test_a_wrong_convention_is_another_base(world, tmp_path, orientation):
    plugin, (q, _) = moved(
        world, pipes(tmp_path, IMU | {"convention": {"position": {"type": "NONE"}, "orientation": orientation}})
    )
    assert np.abs(plugin.robot.state.position[3:6] - q[3:6]).max() > 1e-3


def test_a_published_body_gives_another_robots_base(world, tmp_path):
    received = {key: value for key, value in PUBLISHED.items() if key not in ("type", "sink")} | {"source": "hand"}
    (tmp_path / "listener").mkdir()
    published = world.plugin("test", pipes(tmp_path, BASE, PUBLISHED))
    world.run(0.1)
    plugin, (q, v) = moved(world, pipes(tmp_path / "listener", received), "listener")
    hand, pelvis = published.robot.kinematics.position("arm1_7"), published.robot.kinematics.position("pelvis")
    assert np.linalg.norm(hand - pelvis) > 0.3
    assert_allclose(plugin.robot.state.position[:6], q[:6], atol=1e-9)
    assert_allclose(plugin.robot.state.velocity[:6], v[:6], atol=1e-9)


@pytest.mark.daily(3)
@pytest.mark.parametrize(
    "changes, error, match",
    [
        ({"source": "imu", "message": "sensor_msgs/Imu", "reference": "imu_link"}, PipeError, "carries no position"),
        ({"dofs": BODY | {"name": "pelvis2"}}, UnknownName, "unknown link 'pelvis2'"),
        ({"dofs": BODY | {"chain": "left_arm"}}, PipeError, "lacks DoFs of the floating base"),
        ({"dofs": BODY | {"mapping": "ACTUATED"}}, PipeError, "map 'ACTUATED' lacks DoFs"),
        ({"dofs": BODY | {"type": "all"}}, PipeError, "type 'all' in operational space"),
        ({"interface": {"position": True, "effort": True}}, PipeError, "carries no 'effort'"),
        ({"interface": {"position": False}}, PipeError, "carries no interface"),
        ({"message": "sensor_msgs/JointState"}, PipeError, "JointState carries no rigid body"),
        ({"convention": {"orientation": {"type": "EULER"}}}, PipeError, "no orientation of the type EULER"),
        ({"convention": {"orientation": {"convention": "JLP"}}}, ConfigError, "got 'JLP'"),
        ({"output_angles": {"angle_1": 2, "angle_2": 1, "angle_3": 0}}, PipeError, "turns about x, then y, then z"),
        ({"output_angles": {"angle_1": 2, "angle_2": 1, "angle_3": 2}}, ConfigError, "do not use each axis once"),
        ({"filter": {"frequency": 100.0}}, ConfigError, "cut-off frequency of 100 Hz at 200 steps a second"),
        (
            {"offset_orientation": {"xx": 1, "xy": 0, "xz": 0, "yx": 0, "yy": 1, "yz": 0, "zx": 0, "zy": 0, "zz": -1}},
            ConfigError,
            "determinant is -1",
        ),
    ],
)
def test_mistakes_name_their_place(world, tmp_path, changes, error, match):
    path = pipes(tmp_path, BASE, **changes)
    with pytest.raises(error, match=match) as caught:
        world.plugin("test", path)
    assert caught.value.where.startswith(str(path))


@pytest.mark.daily(2)
@pytest.mark.parametrize(
    "changes, match",
    [
        ({"type": "impedance"}, "in OPERATIONAL space"),
        ({"space": "JOINT", "type": "velocity"}, "cannot be sent measurements"),
        ({"message": "sensor_msgs/Imu"}, "carries no rigid body that a plugin can send"),
        ({"message": "geometry_msgs/PoseStamped"}, "carries no 'velocity'"),
        ({"convention": {"position": {"type": "NONE"}}}, "with a quaternion and a position"),
        ({"filter": {"frequency": 10.0}}, "filters the state of a link"),
    ],
)
def test_mistakes_of_published_bodies_have_a_place(world, tmp_path, changes, match):
    path = pipes(tmp_path, None, PUBLISHED, **changes)
    with pytest.raises(SolferError, match=match) as caught:
        world.plugin("test", path)
    assert caught.value.where.startswith(str(path))

"""The scene of a standing robot from messages, against Pinocchio with a free-flyer and against SciPy."""

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from solfer import Robot
from solfer.interfaces.geometry import Pose, Turn, Vector
from solfer.interfaces.support import SupportMargins
from solfer.interfaces.task_references import TaskReferences
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport import BodyMessage, JointMessage
from solfer.transport.declared.fields import message_of
from solfer.transport.messages import PointsMessage, WrenchMessage
from solfer_tools.scene import LiveScene
from solfer_tools.scene.discovery import STALE_AGE
from solfer_tools.scene.polygon import hull, shrunk

PLACE, TURN = np.array((0.3, -0.2, 0.8)), Rotation.from_euler("xyz", (0.05, -0.1, 0.7))
WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")


@pytest.fixture(scope="module")
def files(repository):
    folder = repository / "config/robots/centauro"
    return {name: folder / file for name, file in
            (("urdf", "centauro.urdf"), ("srdf", "centauro.srdf"), ("contacts", "contacts.yaml"))}  # fmt: skip


@pytest.fixture(scope="module")
def model(files):
    """Make Pinocchio's own robot, whose base has a quaternion."""
    model = pin.buildModelFromUrdf(str(files["urdf"]))
    return model, model.createData()


class Robots:
    """What a robot and its plugins publish on a bus."""

    def __init__(self, files):
        self.bus = Bus()
        self.robot = Robot.load(**files, name="centauro")
        self.node = MemoryMiddleware(self.bus, "robot")
        self.scene = LiveScene(Robot.load(**files, name="centauro"), MemoryMiddleware(self.bus, "scene"))
        self.joints = self.robot.dofs[6:]
        dofs, values = self.robot.named_state("mammal_wide_straight")
        self.positions = np.zeros(self.robot.size)
        self.positions[dofs] = values

    def publish(self):
        self.write("joint_states", "sensor_msgs/JointState", JointMessage(self.joints, position=self.positions[6:]))
        self.write("floating_base", "nav_msgs/Odometry", BodyMessage("world", "pelvis", PLACE, TURN.as_quat()))

    def write(self, topic, interface, message):
        self.node.writer(topic, interface).write(message)

    def carry(self, *vertical):
        """Publish vertical forces at the wheels [N]."""
        names = tuple(record.name for record in self.robot.contact_records[:4])
        values = np.zeros((4, 6))
        values[:, 2] = vertical
        self.write("ground_forces", "solfer/RobotPoints", PointsMessage("world", names, values))

    def look(self):
        """Return the scene of what is published, when topics are known."""
        self.publish()
        self.scene.update()
        return self.scene.update()


@pytest.fixture
def robots(files):
    return Robots(files)


def pose_in(model, joints, values):
    """Return Pinocchio's configuration with this base, whatever joint its URDF has there."""
    model, data = model
    q = pin.neutral(model)
    for name, value in zip(joints, values, strict=True):
        joint = model.joints[model.getJointId(name)]
        q[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
    pin.framesForwardKinematics(model, data, q)
    root = data.oMf[model.getFrameId("pelvis")]
    moved = pin.SE3(TURN.as_matrix(), PLACE) * root.inverse()
    body = pin.FrameType.BODY
    names = [frame.name for frame in model.frames if frame.type == body]
    links = {name: moved * data.oMf[model.getFrameId(name, body)] for name in names}
    return links, moved * pin.centerOfMass(model, data, q)


def test_links_and_center_are_those_of_pinocchio(robots, model):
    """Measured and desired robot: links, centre of mass; the desired one is on the measured base."""
    draw = np.random.default_rng(1)
    for _ in range(3):
        robots.positions[6:] = draw.uniform(-0.5, 0.5, len(robots.joints))
        desired = robots.positions[6:] + draw.uniform(-0.1, 0.1, len(robots.joints))
        command = JointMessage(robots.joints[:20], position=desired[:20])
        robots.write("position_controller/command", "solfer/JointCommand", command)
        state = robots.look()
        links, center = pose_in(model, robots.joints, robots.positions[6:])
        assert_allclose(state.center, center, atol=1e-9)
        assert_allclose(state.measured["pelvis"].position, PLACE, atol=1e-12)
        goal, _ = pose_in(model, robots.joints, [*desired[:20], *robots.positions[26:]])
        for found, expected in ((state.measured, links), (state.desired, goal)):
            for link in set(found) & set(expected) - {"world"}:
                assert_allclose(found[link].position, expected[link].translation, atol=1e-9, err_msg=link)
                assert_allclose(found[link].rotation, expected[link].rotation, atol=1e-9, err_msg=link)
        assert set(WHEELS) < set(state.measured) & set(links)


def test_without_joints_or_base_there_is_no_scene(robots):
    assert robots.scene.update() is None
    robots.publish()
    assert robots.scene.update() is not None
    robots.bus.run_until(robots.bus.time + STALE_AGE + 0.1)
    assert robots.scene.update() is None


def test_the_desired_robot_ends_with_its_commands(robots):
    assert robots.look().desired == {}
    message = JointMessage(robots.joints, position=robots.positions[6:])
    robots.bus.run_until(2.0)
    robots.write("position_controller/command", "solfer/JointCommand", message)
    assert robots.look().desired
    robots.bus.run_until(robots.bus.time + STALE_AGE + 0.1)
    assert robots.look().desired == {}


def test_forces_turn_with_their_link(robots):
    for record in robots.robot.contact_records:
        robots.write(record.topic, "geometry_msgs/WrenchStamped", WrenchMessage("wheel_1", np.array((0.0, 200.0, 0.0))))
    state = robots.look()
    assert len(state.forces) == 6
    for force in state.forces:
        assert_allclose(force.force, state.measured["wheel_1"].rotation @ (0.0, 200.0, 0.0), atol=1e-9)
        assert force.touches == (force.force[2] >= 5.0)


def test_estimated_forces_count_where_none_are_measured(robots):
    robots.carry(100.0, 0.0, 300.0, 400.0)
    state = robots.look()
    assert [force.force[2] for force in state.forces] == [100.0, 0.0, 300.0, 400.0]
    assert len(state.polygon) == 3
    assert_allclose(state.projection[:2], state.center[:2])


def test_margins_shrink_the_polygon(robots):
    robots.carry(*4 * [200.0])
    margins = {("wheel_1", "wheel_2"): 0.1, ("wheel_3", "wheel_4"): 0.05}
    names = tuple(f"margin {first}-{second}" for first, second in margins)
    message = SupportMargins((*names, "workspace wheel_1"), (*margins.values(), 9.0), (0.0,) * 3)
    robots.write("legs/support_margins", "solfer/SupportMargins", message_of("solfer/SupportMargins", message))
    state = robots.look()
    assert len(state.polygon) == 4 and len(state.inner) == 4
    areas = [ConvexHull(corners[:, :2]).volume for corners in (state.polygon, state.inner)]
    assert 0.0 < areas[1] < areas[0] - 0.02


def test_references_are_seen_in_their_frames(robots):
    """References relative to a link are shown in the world; those in frames that are not known are left out."""
    turn = Rotation.from_euler("z", 0.4).as_quat()
    own = Pose(Vector(0.5, 0.2, 0.1), Turn(*turn))
    message = TaskReferences(
        ("left", "gaze", "away"),
        ("pose", "orientation", "position"),
        ("pelvis", "world", "no_link"),
        ("arm1_7", "wheel_1", ""),
        (own, Pose(orientation=Turn(*turn)), own),
        (own,) * 3,
    )
    robots.write("hands/references", "solfer/TaskReferences", message_of("solfer/TaskReferences", message))
    state = robots.look()
    left, gaze = state.references  # others know no frame `no_link`
    assert (left.module, left.task, left.frame) == ("hands", "left", "pelvis")
    assert_allclose(left.reference.position, PLACE + TURN.apply((0.5, 0.2, 0.1)), atol=1e-9)
    assert_allclose(left.reference.rotation, (TURN * Rotation.from_quat(turn)).as_matrix(), atol=1e-9)
    assert_allclose(gaze.reference.position, state.measured["wheel_1"].position, atol=1e-9)
    assert_allclose(gaze.reference.rotation, Rotation.from_quat(turn).as_matrix(), atol=1e-9)


def test_the_path_grows_with_the_base(robots):
    robots.look()
    assert len(robots.look().path) == 1
    for step in range(1, 4):
        moved = BodyMessage("world", "pelvis", PLACE + (0.03 * step, 0.0, 0.0), TURN.as_quat())
        robots.write("floating_base", "nav_msgs/Odometry", moved)
        state = robots.scene.update()
    assert_allclose(state.path[:, 0], PLACE[0] + 0.03 * np.arange(4), atol=1e-9)


def test_the_hull_is_that_of_scipy():
    draw = np.random.default_rng(2)
    for count in (3, 4, 8, 40):
        points = draw.normal(size=(count, 3))
        corners = ConvexHull(points[:, :2]).vertices.tolist()  # against the clock
        found = hull(points)
        assert sorted(found) == sorted(corners)
        start = corners.index(found[0])
        assert found == corners[start:] + corners[:start]
    assert len(hull(np.array(((0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 2.0, 0.0))))) < 3


def test_a_margin_is_the_distance_from_its_edge():
    square = np.array(((0.0, 0.0, 0.5), (2.0, 0.0, 0.5), (2.0, 1.0, 0.5), (0.0, 1.0, 0.5)))
    left = shrunk(square, (0.1, 0.2, 0.3, 0.4)).round(9)
    assert_allclose(sorted(map(tuple, left)), [(0.4, 0.1, 0.5), (0.4, 0.7, 0.5), (1.8, 0.1, 0.5), (1.8, 0.7, 0.5)])
    assert shrunk(square, (0.6, 0.0, 0.6, 0.0)).shape == (0, 3)

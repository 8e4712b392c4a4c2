"""Listings 2, 3 and 4 of the paper, as a user runs them: every number against Pinocchio alone."""

import re
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
CENTAURO = EXAMPLES.parent / "config/robots/centauro"
TALOS = "cmeel.prefix/share/example-robot-data/robots/talos_data/robots/talos_reduced.urdf"
LINKS = {
    "centauro": ("arm1_7", "arm2_7", "torso_2", "pelvis"),
    "talos": ("arm_left_7_link", "arm_right_7_link", "torso_2_link", "base_link"),
}
POSTURES = {"centauro": (CENTAURO / "centauro.srdf", "home"), "talos": (EXAMPLES / "talos.srdf", "half_sitting")}
ARMS = {"centauro": r"j_arm\d_\d", "talos": r"arm_(left|right)_\d_joint"}
STEPS, RESOLUTION = 6, 1e-6  # [m]


@dataclass
class PinocchioRobot:
    """A robot in Pinocchio, with its base on three prismatic and three revolute joints."""

    model: pin.Model
    q: np.ndarray
    links: tuple[str, str, str, str]

    def __post_init__(self):
        self.data = self.model.createData()

    def frame(self, link):
        """Pose of a link, and the Jacobian of its origin in world axes."""
        pin.computeJointJacobians(self.model, self.data, self.q)
        pin.updateFramePlacements(self.model, self.data)
        frame = self.model.getFrameId(link, pin.FrameType.BODY)
        jacobian = pin.getFrameJacobian(self.model, self.data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        return self.data.oMf[frame], jacobian[:3].copy()

    def position(self, link):
        """Position of a link, and its Jacobian."""
        pose, jacobian = self.frame(link)
        return pose.translation.copy(), jacobian

    def center_of_mass(self):
        """Centre of mass, and its Jacobian."""
        jacobian = pin.jacobianCenterOfMass(self.model, self.data, self.q)
        return self.data.com[0].copy(), jacobian.copy()

    def relative(self, link):
        """Position of a link as seen from that of the torso, and its Jacobian."""
        (position, jacobian), (torso, torso_jacobian) = self.position(link), self.position(self.links[2])
        return position - torso, jacobian - torso_jacobian

    def move(self, velocity):
        """Add a step of all DoFs."""
        self.q = pin.integrate(self.model, self.q, velocity)


@pytest.fixture(params=["centauro", "talos"])
def reference(request):
    """Make the robot in the posture of its SRDF."""
    name = request.param
    if name == "centauro":
        urdf = CENTAURO / "centauro.urdf"
    else:
        try:
            urdf = Path(str(distribution("example-robot-data").locate_file(TALOS)))
        except PackageNotFoundError:
            pytest.skip("needs pip install -r requirements-examples.txt")
    model = on_a_floating_base(urdf.read_text())
    q, (srdf, posture) = pin.neutral(model), POSTURES[name]
    for joint in ElementTree.parse(srdf).iterfind(f"group_state[@name='{posture}']/joint"):
        moved = model.joints[model.getJointId(joint.get("name"))]
        if moved.nq == 1:
            q[moved.idx_q] = float(joint.get("value"))
    return PinocchioRobot(model, q, LINKS[name])


def on_a_floating_base(text):
    """Build the model; a floating joint of its own becomes the base, with its place in the world."""
    base = pin.JointModelComposite(6)
    for joint in (
        pin.JointModelPX,
        pin.JointModelPY,
        pin.JointModelPZ,
        pin.JointModelRX,
        pin.JointModelRY,
        pin.JointModelRZ,
    ):
        base.addJoint(joint())
    robot, place = ElementTree.fromstring(text), pin.SE3.Identity()
    floating = robot.find("joint[@type='floating']")
    if floating is not None:
        place.translation = np.array([float(number) for number in floating.find("origin").get("xyz").split()])
        floating.set("type", "fixed")
        floating.remove(floating.find("origin"))
    model = pin.buildModelFromXML(ElementTree.tostring(robot, encoding="unicode"), base)
    model.jointPlacements[1] = place
    return model


def printed(number, robot):
    """Return what the example of a listing prints: rows of numbers with six decimals."""
    command = [sys.executable, str(EXAMPLES / f"listing_{number}.py"), *robot]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    rows = [re.findall(r"\d+\.\d{6}", line) for line in done.stdout.splitlines()]
    return np.array([[float(number) for number in row] for row in rows if row])


def name_of(reference):
    """Return the robot for the command line; CENTAURO is the default."""
    return [] if reference.links == LINKS["centauro"] else ["talos"]


@pytest.mark.daily(1)
def test_listing_2_brings_a_hand_to_its_reference(reference):
    published = printed(2, name_of(reference))
    hand, goal, expected = reference.links[0], reference.position(reference.links[0])[0] + (0.0, 0.1, 0.1), []
    for _ in range(STEPS):
        position, jacobian = reference.position(hand)
        expected.append([np.linalg.norm(goal - position)])
        # the base stands still
        step = np.linalg.pinv(jacobian[:, 6:]) @ (goal - position)
        reference.move(np.concatenate((np.zeros(6), step)))
    assert_allclose(published, expected, atol=RESOLUTION)
    assert published[0, 0] > 0.14 and published[-1, 0] < RESOLUTION


@pytest.mark.daily(1)
def test_listing_3_brings_all_points_to_their_references(reference):
    published = printed(3, name_of(reference))
    left, right = reference.links[:2]

    def tasks():
        stack = reference.center_of_mass(), reference.relative(left), reference.relative(right)
        return np.concatenate([value for value, _ in stack]), np.vstack([jacobian for _, jacobian in stack])

    goal, expected = tasks()[0] + (0.02, 0.0, -0.05, 0.1, 0.0, 0.0, 0.0, 0.0, 0.1), []
    for _ in range(STEPS):
        value, jacobian = tasks()
        expected.append(np.linalg.norm((goal - value).reshape(3, 3), axis=1))
        reference.move(np.linalg.pinv(jacobian) @ (goal - value))
    assert_allclose(published, expected, atol=RESOLUTION)
    assert published[0].min() > 0.05 and published[-1].max() < RESOLUTION


@pytest.mark.daily(1)
def test_listing_4_prints_distances_from_the_base(reference):
    """Pinocchio alone gives the expected distances, through four steps of 0.2 rad of all 14 joints of the arms."""
    robot = name_of(reference)
    published, expected = printed(4, robot), []
    arms = [
        joint.idx_v
        for name, joint in zip(reference.model.names, reference.model.joints, strict=True)
        if re.fullmatch(ARMS[robot[0] if robot else "centauro"], name)
    ]
    turn = np.zeros(reference.model.nv)
    turn[arms] = 0.2
    for _ in range(4):
        base = reference.position(reference.links[3])[0]
        poses = [reference.frame(hand)[0] for hand in reference.links[:2]]
        expected.append([np.linalg.norm(pose.act(np.array((0.0, 0.0, -0.15))) - base) for pose in poses])
        reference.move(turn)
    assert len(arms) == 14
    assert_allclose(published, expected, atol=RESOLUTION)


def test_an_unknown_robot_error_names_the_known():
    command = [sys.executable, str(EXAMPLES / "listing_2.py"), "atlas"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2
    assert "'atlas'" in done.stderr and "Traceback" not in done.stderr
    assert "centauro, talos" in done.stderr.replace("'", "")  # from Python 3.12 on choices have no quotes

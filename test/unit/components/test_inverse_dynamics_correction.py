"""The model that corrects itself, by forces that carry a model of Pinocchio which is not that of the Robot."""

import math
import sys

import numpy as np
import pinocchio as pin
import pytest
from support.allocations import check_that_it_keeps_no_memory
from support.robots import CONTACTS, SRDF, URDF, centauro

from solfer.components.inverse_dynamics import InverseDynamics
from solfer.components.inverse_dynamics.correction_kernel import LARGEST, LARGEST_SHARE
from solfer.errors import ComponentError, ModelError
from solfer.points import AngularMomentum
from solfer.robot import Robot

STEP = 0.005  # [s]
PELVIS = 6  # Pinocchio's joint
WHEELS = 4
STACK = {"tasks": {"com": {"point": "center_of_mass", "gain": 8.0}}, "levels": (("com",),)}


class Carried:
    """CENTAURO at rest on forces of four wheels that carry another mass, with its centre elsewhere.

    Args:
        aside: By how much the true centre of mass is aside, axes of the pelvis, shape (3,) [m].
        share: By how much the true mass is larger, as a share of it.
        turn: Orientation of the base, shape (3,) [rad].
    """

    def __init__(self, aside=(0.0, 0.0, 0.0), share=0.0, turn=(0.0, 0.0, 0.0)):
        self.robot = centauro("mammal_wide_straight")
        self.robot.state.position[3:6] = turn
        self.robot.update()
        tags = {"track": "wheels", "correct_model": True, "stack": STACK}
        self.component = InverseDynamics(self.robot, InverseDynamics.Tags.model_validate(tags))
        self.component.set_rate(1.0 / STEP)
        self.component.start_position = self.robot.state.position.copy()
        self.correction = self.component.correction
        self.correction.start()
        self.known = self.robot.kinematics.pinocchio[0].copy()
        self.random = np.random.default_rng(1)
        self.load(aside, share)

    def load(self, aside, share=0.0):
        """Let forces carry another mass."""
        self.true = other(self.known, np.array(aside), share)

    @property
    def center(self):
        """The true centre of mass."""
        return pin.centerOfMass(self.true, self.true.createData(), self.robot.state.position).copy()

    def run(self, time, push=(0.0, 0.0, 0.0), moment=(0.0, 0.0, 0.0)):
        """Let a time [s] pass with the ground's answer to a push [N] and a moment on the robot [Nm]."""
        places = self.robot.contacts.positions[:WHEELS]
        rows = np.vstack((np.tile(np.eye(3), WHEELS), np.hstack([pin.skew(p - self.center) for p in places])))
        weight = 9.81 * pin.computeTotalMass(self.true)
        load = np.array((0.0, 0.0, weight, 0.0, 0.0, 0.0)) - (*push, *moment)
        forces = np.linalg.lstsq(rows, load)[0].reshape(WHEELS, 3)
        for _ in range(round(time / STEP)):
            self.robot.contacts.forces[:WHEELS] = forces + self.random.normal(0.0, 0.5, (WHEELS, 3))
            self.correction.update(STEP)


def other(model, aside, share):
    """Return a model with another mass, and a base whose centre moves the whole centre of mass, axes of the base."""
    made = model.copy()
    total = pin.computeTotalMass(model)
    for joint in range(1, model.njoints):
        inertia = model.inertias[joint]
        lever = inertia.lever + (total * aside / inertia.mass if joint == PELVIS else 0.0)
        made.inertias[joint] = pin.Inertia(inertia.mass * (1.0 + share), lever, inertia.inertia * (1.0 + share))
    return made


def test_a_second_component_begins_with_the_file():
    """On a Robot that it shares with one that has corrected the model."""
    carried = Carried((0.02, 0.0, 0.0), 0.1)
    inertial = carried.robot.kinematics.tree.inertial
    # beside the work space of kernels
    bodies = len(inertial) // 23
    before = inertial[: 13 * bodies].copy()
    carried.run(8.0)
    assert not np.allclose(before, inertial[: 13 * bodies])
    second = InverseDynamics(carried.robot.companion(), carried.component.tags)
    second.set_rate(1.0 / STEP)
    second.correction.start()
    assert np.array_equal(before, inertial[: 13 * bodies])


def test_an_orientation_that_is_wrong_does_not_count():
    """The base seems to be tilted by 0.02 rad: places, centre and forces of sensors turn with it."""
    carried = Carried((0.015, -0.01, 0.0))
    tilt = pin.exp3(np.array((0.02, 0.0, 0.0)))
    carried.robot.contacts.positions[:] = carried.robot.contacts.positions @ tilt.T
    placements = carried.robot.kinematics.tree.placements.reshape(-1, 4, 3)
    placements[:] = placements @ tilt.T
    correction = carried.correction
    places = carried.robot.contacts.positions[:WHEELS]
    center = tilt @ carried.center
    rows = np.vstack((np.tile(np.eye(3), WHEELS), np.hstack([pin.skew(p - center) for p in places])))
    up = tilt @ (0.0, 0.0, 9.81 * pin.computeTotalMass(carried.true))
    forces = np.linalg.lstsq(rows, np.append(up, np.zeros(3)))[0].reshape(WHEELS, 3)
    for _ in range(1600):
        carried.robot.contacts.forces[:WHEELS] = forces + carried.random.normal(0.0, 0.5, (WHEELS, 3))
        correction.update(STEP)
    assert correction.reason == "estimates"
    assert correction.offset[:2] == pytest.approx((0.015, -0.01), abs=5e-4)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_drawn_error_is_found_and_the_model_follows(seed):
    """With any heading; the vertical error of a level robot cannot be found, and stays zero."""
    random = np.random.default_rng(seed)
    aside = random.uniform(-0.025, 0.025, 3)
    share = random.uniform(-0.2, 0.2)
    carried = Carried(aside, share, (0.0, 0.0, random.uniform(-3.0, 3.0)))
    carried.run(10.0)
    correction = carried.correction
    assert correction.reason == "estimates"
    assert correction.offset == pytest.approx((*aside[:2], 0.0, share), abs=3e-4)
    assert correction.applied == pytest.approx(correction.offset, abs=1e-4)
    carried.robot.state.touch("position")
    carried.robot.state.position[6] += 1e-9
    carried.robot.update()
    assert carried.robot.center_of_mass.value[:2] == pytest.approx(carried.center[:2], abs=3e-4)
    assert correction.deviation[:2].max() < 0.002 < 0.01 < correction.deviation[2]


def test_a_base_that_tilts_shows_the_vertical_error():
    carried = Carried((0.01, -0.005, 0.015), turn=(0.25, -0.2, 0.5))
    carried.run(15.0)
    assert carried.correction.deviation[2] > 0.015  # what is vertical in the world is still unknown
    carried.robot.state.position[3:5] *= -1.0
    carried.robot.update()
    carried.run(15.0)
    error = carried.correction.offset[:3] - (0.01, -0.005, 0.015)
    assert (np.abs(error) < 3.0 * carried.correction.deviation[:3]).all() and abs(error[2]) < 0.004


def test_bias_inertia_and_points_are_those_of_one_corrected_model():
    """As Pinocchio has them for a model with the same masses; a start brings the model of the file back."""
    carried = Carried((0.02, -0.01, 0.0), 0.15, (0.1, -0.05, 0.4))
    carried.run(10.0)
    robot = carried.robot
    momentum = AngularMomentum(robot)
    random = np.random.default_rng(2)
    for corrected in (True, False):
        model = other(carried.known, carried.correction.applied[:3], carried.correction.applied[3])
        assert corrected or carried.correction.applied.tolist() == [0.0] * 4
        robot.state.position[6:] += random.uniform(-0.2, 0.2, robot.size - 6)
        robot.state.velocity[:] = random.normal(0.0, 0.3, robot.size)
        robot.update()
        momentum.update()
        q, v, data = robot.state.position, robot.state.velocity, model.createData()
        assert robot.dynamics.bias == pytest.approx(pin.nonLinearEffects(model, data, q, v), abs=1e-8)
        inertia = pin.crba(model, data, q)
        inertia = np.triu(inertia) + np.triu(inertia, 1).T
        assert robot.dynamics.inertia == pytest.approx(inertia + np.diag(robot.kinematics.tree.armature), abs=1e-9)
        assert robot.center_of_mass.value == pytest.approx(pin.centerOfMass(model, data, q), abs=1e-10)
        jacobian = pin.jacobianCenterOfMass(model, data, q)
        assert robot.center_of_mass.jacobian == pytest.approx(jacobian, abs=1e-10)
        pin.computeCentroidalMomentum(model, data, q, v)
        assert momentum.value == pytest.approx(data.hg.angular, abs=1e-9)
        carried.correction.start()


def test_a_push_changes_nothing():
    """100 N for 0.2 s, 0.2 m above the centre of mass."""
    carried = Carried((0.01, 0.0, 0.0))
    carried.run(8.0)
    before = carried.correction.offset.copy()
    carried.run(0.2, push=(0.0, 100.0, 0.0), moment=(-20.0, 0.0, 0.0))
    assert carried.correction.reason == "the robot is pushed or accelerates"
    carried.run(1.0)
    assert carried.correction.reason == "estimates"
    assert carried.correction.offset == pytest.approx(before, abs=3e-4)


def test_a_load_that_comes_counts_once_it_stays():
    """A new offset contradicts the old one for 5 s, as a moment that somebody exerts would; then it is found."""
    carried = Carried()
    carried.run(8.0)
    before = carried.correction.offset.copy()
    carried.load((0.03, 0.0, 0.0))
    carried.run(3.0)
    assert carried.correction.reason == "forces contradict the estimate"
    assert carried.correction.report("squat").level == 1
    assert carried.correction.offset == pytest.approx(before, abs=5e-4)
    carried.run(6.0)
    assert carried.correction.offset[:2] == pytest.approx((0.03, 0.0), abs=1e-3)


def test_estimates_are_bounded_and_say_so():
    carried = Carried((0.0, -0.09, 0.0), 0.7)
    carried.run(8.0)
    assert carried.correction.offset[1] == -LARGEST and carried.correction.offset[3] == LARGEST_SHARE
    status = carried.correction.report("squat")
    assert status.level == 1 and status.message == "an error is as large as it may be"
    assert status.values[1].value.startswith("-50.0 mm, deviation")


def invalid(carried):
    """Let one number of a force be none."""
    carried.robot.contacts.forces[2, 1] = math.nan


def absent(carried):
    """Let no force be measured."""
    carried.robot.contacts.wrenches[:] = 0.0


def silent(carried):
    """Let forces stay as they were, with a centre that is elsewhere."""
    carried.robot.contacts.forces[0, 2] += 5.0


def lifting(carried):
    """Let a contact be about to go."""
    carried.component.ground.fractions[1] = 0.5
    carried.robot.contacts.forces[0, 2] += 1e-3


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        (invalid, "a force is not finite"),
        (absent, "forces are not measured"),
        (silent, "forces do not change any more"),
        (lifting, "contacts come or go"),
    ],
)
def test_forces_that_do_not_count_freeze_it(fault, reason):
    """Within 0.1 s; afterwards, half a second passes until they count again."""
    carried = Carried((0.01, 0.01, 0.0), 0.1)
    carried.run(6.0)
    before = carried.correction.offset.copy()
    fault(carried)
    for _ in range(200):
        carried.correction.update(STEP)
        if fault is lifting:
            fault(carried)
    assert carried.correction.reason == reason
    assert carried.correction.offset == pytest.approx(before, abs=3e-4)
    carried.component.ground.fractions[:] = 1.0
    carried.robot.contacts.wrenches[:] = 0.0
    carried.run(0.3)
    assert carried.correction.reason != "estimates"
    carried.run(1.0)
    assert carried.correction.reason == "estimates"
    assert carried.correction.offset == pytest.approx(before, abs=3e-4)


def test_a_cycle_costs_ten_calls_and_no_memory():
    carried = Carried()
    carried.run(1.0)
    calls = []
    sys.setprofile(lambda frame, event, _: calls.append(frame.f_code.co_name) if event == "call" else None)
    try:
        carried.correction.update(STEP)
    finally:
        sys.setprofile(None)
    assert len(calls) <= 10, calls

    def cycle():
        carried.robot.contacts.forces[0, 2] += 1e-3
        carried.correction.update(STEP)

    check_that_it_keeps_no_memory(cycle)


ARM = """<robot name="arm"><link name="base"/><link name="arm"><inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint></robot>"""
POSTURE = {"tasks": {"rest": {"point": "posture", "gain": 1.0}}, "levels": (("rest",),)}


def test_a_robot_on_a_fixed_base_is_refused():
    robot = Robot.load(ARM, floating_base=False)
    tags = InverseDynamics.Tags.model_validate({"correct_model": True, "stack": POSTURE})
    with pytest.raises(ComponentError, match="a floating base that gravity pulls"):
        InverseDynamics(robot, tags)


def test_a_base_without_a_mass_is_refused():
    text = URDF.read_text()
    begin = text.index("<inertial>", text.index('<link name="pelvis">'))
    end = text.index("</inertial>", begin) + len("</inertial>")
    robot = Robot.load(text[:begin] + text[end:], SRDF, contacts=CONTACTS)
    tags = InverseDynamics.Tags.model_validate({"correct_model": True, "track": "wheels", "stack": STACK})
    with pytest.raises(ModelError, match="link 'pelvis' has no mass"):
        InverseDynamics(robot, tags)

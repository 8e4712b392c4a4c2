"""The component `ground_forces`, without any transport: golden forces, weighted forces, and what touches."""

import numpy as np
import pytest
from support.allocations import check_that_it_keeps_no_memory
from support.robots import centauro
from support.unit.golden import golden

from solfer.components.ground_forces import GroundForces
from solfer.components.ground_forces.offsets import TorqueOffsets
from solfer.components.ground_forces.tags import GroundForcesTags, OffsetTags
from solfer.components.ground_forces.touch import Touch
from solfer.errors import ComponentError
from solfer.transport.declared.fields import plain

FILTER = {"cut_off_frequency": 20.0}
WHEELS, STAMPED = slice(0, 4), "geometry_msgs/WrenchStamped"


@pytest.fixture
def robot():
    return centauro("mammal_wide_straight")


def component(robot, **tags):
    made = GroundForces(robot, GroundForcesTags(track="wheels", **tags))
    made.set_rate(200.0)
    robot.update()
    robot.dynamics.update()
    made.init()
    return made


def cycle(made, count=1):
    for _ in range(count):
        made.model.update()
        made.model.dynamics.update()
        made.update()


def carried(robot, forces):
    """Return the torques with which a resting robot stands on forces, shape (4, 3)."""
    robot.update()
    jacobian = np.concatenate([robot.contacts[name].jacobian for name in robot.contacts.names[:4]])
    return robot.dynamics.bias - jacobian.T @ np.ravel(forces)


def test_forces_are_those_of_the_original(robot):
    """Recorded rows of the C++ program are the oracle for forces, bias and centre of pressure along a motion."""
    data, columns = golden("ground_forces")
    i, rows = np.arange(48), data["rows"]
    amplitude, rate = np.where(i < 6, 0.02, 0.05), 0.5 + 0.03 * i
    made = component(robot)
    bias = robot.state["bias_force"]
    for row in map(np.array, rows):
        phase = rate * row[0] + 0.4 * i
        robot.state.position[:] = data["posture"] + amplitude * np.sin(phase)
        robot.state.velocity[:] = amplitude * rate * np.cos(phase)
        robot.state.torque[:] = row[[columns[f"tau_filtered.{dof}"] for dof in data["dof_names"]]]
        cycle(made)
        expected = np.array([[row[columns[f"f.{name}_{axis}"]] for axis in "xyz"] for name in data["contacts"]])
        np.testing.assert_allclose(robot.contacts.forces[WHEELS], expected, atol=1e-6 * np.abs(expected).max())
        base = [row[columns[f"BIAS_FORCE.{dof}"]] for dof in data["dof_names"][:6]]
        np.testing.assert_allclose(bias[:6], base, atol=1e-4)
        if (expected[:, 2] > 0.0).all():
            pressed = [row[columns[f"cop_{axis}"]] for axis in "xyz"]
            np.testing.assert_allclose(made.outputs["center_of_pressure"].value, pressed, atol=1e-6)


def test_weighted_forces_find_a_lifted_wheel(robot):
    forces = np.array([(3.0, -2.0, 0.0), (1.0, 2.0, 470.0), (0.0, 4.0, 460.0), (2.0, 1.0, 0.0)])
    mass = robot.kinematics.mass * 9.81
    forces[1:3, 2] *= mass / forces[:, 2].sum()
    robot.state.torque[:] = carried(robot, forces)
    made = component(robot, method="weighted", touch={}, push_deviation=50.0)
    push = made.outputs["external_wrench"].value
    np.testing.assert_array_equal(made.touch.touching, (False, True, True, False))
    np.testing.assert_allclose(robot.contacts.forces[[1, 2]], forces[[1, 2]], atol=0.05 * mass)
    assert not robot.contacts.forces[[0, 3]].any() and np.isfinite(push).all()


def test_the_weighted_fit_is_least_squares(robot):
    random = np.random.default_rng(4)
    robot.state.position[6:] += random.uniform(-0.1, 0.1, robot.size - 6)
    robot.state.torque[6:] = random.normal(scale=50.0, size=robot.size - 6)
    made = component(robot, method="weighted", push_deviation=30.0, torque_deviation=2.0)
    jacobian = np.concatenate([contact.jacobian for contact in made.contacts])
    world = robot.dynamics.bias - robot.state.torque
    scale = np.r_[np.full(6, 30.0), np.full(robot.size - 6, 2.0)]
    forces, *_ = np.linalg.lstsq(jacobian.T / scale[:, None], world / scale, rcond=None)
    np.testing.assert_allclose(robot.contacts.forces[WHEELS].ravel(), forces, rtol=1e-6, atol=1e-3)
    rest = world - jacobian.T @ forces
    np.testing.assert_allclose(made.outputs["external_wrench"].value[:3], rest[:3], atol=1e-3)


def offsets_by_least_squares(robot, cycles, lifted, push):
    """Solve for forces of each cycle, pushes and offsets together, shape (24,): a second implementation."""
    rows, right, count = [], [], len(cycles)
    for index, (jacobian, world) in enumerate(cycles):
        kept = np.flatnonzero(~np.repeat(lifted, 3))
        block = np.zeros((30, 24 + 12 * count))
        block[6:, :24] = -np.eye(24)
        block[:, 24 + 12 * index + kept] = jacobian[kept, :30].T
        scale = np.sqrt(0.1 / 0.005) * np.r_[np.full(6, push), np.ones(24)]
        rows.append(block / scale[:, None])
        right.append(world[:30] / scale)
    known = np.eye(24, 24 + 12 * count) / 1.2
    return np.linalg.lstsq(np.concatenate([*rows, known]), np.concatenate([*right, np.zeros(24)]), rcond=None)[0][:24]


@pytest.mark.parametrize("lifted", [(False,) * 4, (False, False, True, False)])
def test_offsets_are_the_likeliest_ones(robot, lifted):
    """A batch least squares over the same cycles is the oracle; amid pushes a lifted leg learns its true offsets."""
    random, lifted = np.random.default_rng(8), np.array(lifted)
    true = np.zeros(robot.size)
    true[6:30] = random.uniform(-2.0, 2.0, 24)
    deviations = np.r_[np.full(6, 100.0), np.ones(robot.size - 6)]
    contacts = list(robot.contacts)[:4]
    learnt = TorqueOffsets(contacts, deviations, OffsetTags(memory=1e6), base=True)
    learnt.start(0.005)
    cycles, home = [], robot.state.position.copy()
    for _ in range(8):
        robot.state.position[:] = home + random.uniform(-0.2, 0.2, robot.size)
        robot.update()
        robot.contacts.update()
        jacobian = np.concatenate([contact.jacobian for contact in contacts])
        forces = random.normal((0.0, 0.0, 230.0), 50.0, (4, 3)) * ~lifted[:, None]
        cycles.append((jacobian, forces.ravel() @ jacobian - true + random.normal(scale=0.1, size=robot.size)))
        learnt.update(*cycles[-1], lifted, pushed=False)
    np.testing.assert_allclose(learnt.value[6:30], offsets_by_least_squares(robot, cycles, lifted, 20.0), atol=1e-3)
    for _ in range(60):
        learnt.update(*cycles[random.integers(8)], lifted, pushed=True)
    legs = learnt.value[6:30].reshape(4, 6)
    assert not lifted.any() or abs(legs[lifted] - true[6:30].reshape(4, 6)[lifted]).max() < 0.4


@pytest.mark.slow
def test_a_cycle_keeps_no_memory(robot):
    robot.state.torque[:] = carried(robot, np.tile((0.0, 0.0, 230.0), (4, 1)))
    made = component(robot, method="weighted", observer=40.0, touch={}, offsets={}, filter={"torque": FILTER})
    robot.state.velocity[:] = 0.01
    check_that_it_keeps_no_memory(made.update)


def test_each_contact_has_a_topic(robot):
    """The wrench is in the axes of its link, at the link's origin."""
    robot.state.position[3:5] = 0.1, -0.2
    robot.state.torque[:] = carried(robot, np.tile((5.0, -8.0, 230.0), (4, 1)))
    made = component(robot, method="weighted")
    topics = {topic.name: topic for topic in made.topics() if topic.name != "/diagnostics"}
    assert tuple(topics) == made.names and {each.interface for each in topics.values()} == {STAMPED}
    sent = plain(topics["front_left_leg"].collect())
    link, contact = "wheel_1", robot.contacts["front_left_leg"]
    turn, arm = robot.kinematics.rotation(link), contact.value - robot.kinematics.position(link)
    assert sent["header"]["frame_id"] == link
    force, torque = ([sent["wrench"][what][axis] for axis in "xyz"] for what in ("force", "torque"))
    np.testing.assert_allclose(turn @ force, contact.force)  # up: what the ground does to the robot
    np.testing.assert_allclose(turn @ torque, np.cross(arm, contact.force), atol=1e-12)
    assert {each.rate for each in topics.values()} == {50.0}


def test_what_the_ground_does_not_explain_is_a_push(robot):
    forces = np.tile((0.0, 0.0, 0.25 * robot.kinematics.mass * 9.81), (4, 1))
    robot.state.torque[:] = carried(robot, forces)
    robot.state.torque[0] -= 80.0  # as if the world pushed the base along x
    robot.state.torque[5] -= 15.0
    made = component(robot, method="weighted", push_deviation=1000.0, torque_deviation=0.01)

    cycle(made, 3)
    pushed = made.outputs["external_wrench"].value + carried(robot, forces)[:6]
    torque = robot.state.torque[:6] - carried(robot, forces)[:6]
    np.testing.assert_allclose((torque[0], torque[5]), (-80.0, -15.0))
    np.testing.assert_allclose(pushed[[0, 5]] - carried(robot, forces)[[0, 5]], (80.0, 15.0), atol=1.0)


def test_contacts_touch_with_delay_and_hysteresis():
    touch, rest = Touch(2, above=30.0, below=15.0, delay=0.01, speed=100.0), np.zeros(2)
    touch.start(np.array((50.0, 20.0)))
    seen = []
    for force in (20.0, 14.0, 20.0, 14.0, 14.0, 20.0, 31.0, 31.0):
        touch.update(np.array((force, 0.0)), rest, 0.005)
        seen.append(bool(touch.touching[0]))
    assert seen == [True, True, True, True, False, False, False, True]
    assert not touch.touching[1] and not touch.lifted.any()
    for _ in range(20):
        touch.update(np.array((40.0, 40.0)), np.array((0.0, -0.2)), 0.005)  # what falls this fast touches nothing
    np.testing.assert_array_equal((touch.touching, touch.lifted), ((True, False), (False, True)))


def test_a_group_without_contacts_is_refused(robot):
    with pytest.raises(ComponentError, match="pushes no contact"):
        GroundForces(robot, GroundForcesTags(track="base"))


@pytest.mark.parametrize(
    ("force", "others", "friction", "summary", "entry"),
    [
        ((30.0, 40.0, 100.0), 280.0, 0.51, "all contacts push", "presses with 100.0 N, 0.50 of that along the ground"),
        ((30.0, 40.0, 100.0), 280.0, 0.49, "'front_left_leg' needs a friction of 0.50, the ground has 0.49", "0.50 of"),
        ((30.0, 40.0, 100.0), 280.0, None, "all contacts push", "0.50 of that"),
        ((30.0, 40.0, -6.0), 300.0, 0.49, "'front_left_leg' pulls, which the ground cannot do", "pulls with 6.0 N"),
        ((30.0, 40.0, -4.0), 300.0, 0.49, "all contacts push", "does not press"),
        ((0.0, 0.0, 100.0), 100.0, None, "contacts carry 0.43 of the robot's weight", "presses with 100.0 N"),
        ((0.0, 0.0, 600.0), 600.0, None, "contacts carry 2.6 of the robot's weight", "presses with 600.0 N"),
    ],
)
def test_forces_that_ground_cannot_have(robot, caplog, *, force, others, friction, summary, entry):
    """Pulling or slipping contacts are a warning with the leg's name, within a tolerance that noise needs.

    Forces of another sum than the weight are a warning of the log, too.
    """
    made = component(robot, friction=friction)
    reports = {topic.name: topic.collect for topic in made.topics()}
    for contact, upward in zip(made.contacts, (None, others, others, others), strict=True):
        contact.wrench[:3] = force if upward is None else (0.0, 0.0, upward)
    made.law.update = lambda *_: None
    cycle(made, 200)
    (first,) = reports["/diagnostics"]().status
    cycle(made, 200)
    (second,) = reports["/diagnostics"]().status
    assert first == second
    assert second.message.startswith(summary) and second.name == "ground_forces: contacts"
    assert second.level == int(not summary.startswith("all"))
    entries = {each.key: each.value for each in second.values}
    assert entry in entries["front_left_leg"] and len(entries) == 4
    logged = [summary in record.getMessage() for record in caplog.records]
    assert logged == ([True] if summary.startswith("contacts carry") else [])

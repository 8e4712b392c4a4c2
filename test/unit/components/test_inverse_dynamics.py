"""The component `inverse_dynamics` on CENTAURO, without any transport, beside Pinocchio and another solver."""

import math
import re
from ctypes import c_int

import daqp
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation
from support import robots
from support.allocations import check_that_it_keeps_no_memory
from support.robots import CENTAURO, CONTACTS, SRDF, URDF

from solfer.components.inverse_dynamics import InverseDynamics
from solfer.components.inverse_dynamics.component import SECOND_LEVEL_WEIGHT
from solfer.components.inverse_dynamics.problem import ACCELERATION_WEIGHT, FORCE_WEIGHT
from solfer.errors import ComponentError, ConfigError, ModelError, SolferError, UnknownName
from solfer.interfaces.geometry import Pose, Vector
from solfer.interfaces.ground import GroundEstimate
from solfer.interfaces.support import LiftContacts
from solfer.interfaces.task_references import GetReference, ReachGoal, SetReference
from solfer.numerics.planar_move import PlanarMove
from solfer.plugins import check_file
from solfer.recording.log import Logger
from solfer.robot import Robot

RATE = 200.0  # [Hz]
FRICTION, SETTLE = 0.8, 10.0
TASKS = {
    "com": {"point": "center_of_mass", "gain": 8.0},
    "base": {"point": "orientation", "link": "pelvis", "gain": 8.0},
    "posture": {"point": "posture", "gain": 5.0, "without": ("wheels",)},
}
LEVELS = (("com", "base"), ("posture",))


def centauro(**files):
    return robots.centauro("mammal_wide_straight", actuators=True, **files)


def made(robot=None, tasks=TASKS, levels=LEVELS, limits=None, **tags):
    stack = {"tasks": tasks, "levels": levels, "limits": limits or {}}
    known = {"track": "wheels", "friction": FRICTION, "settle": SETTLE, "stack": stack}
    component = InverseDynamics(robot or centauro(), InverseDynamics.Tags.model_validate(known | tags))
    component.set_rate(RATE)
    return component


def started(robot=None, **tags):
    component = made(robot, **tags)
    component.start_position = component.model.state.position.copy()
    component.init()
    return component


def cycle(component, count=1):
    for _ in range(count):
        component.model.update()
        component.model.dynamics.update()
        component.update()
        component.send()
    return component.model.command


def draw(component, random, spread=0.1, speed=0.3):
    """Put the robot into a state near the one of its start."""
    state = component.model.state
    size = component.model.size
    state.position[:] = component.start_position + random.uniform(-spread, spread, size)
    state.velocity[:] = random.normal(0.0, speed, size)
    component._watch.start()  # no motion leads there


class Second:
    """The same problem by Pinocchio's frames and with all unknowns, for another solver.

    Args:
        component: The component, of which only the Robot's state and the references are used.
        torque_scale: Share of the torque limits.
    """

    def __init__(self, component, torque_scale=1.0):
        self._component = component
        self._robot = component.model
        self._model, _ = self._robot.kinematics.pinocchio
        self._data = self._model.createData()
        self._torques = torque_scale * self._robot.upper_limits.torque
        self._radii = 0.01, 0.068

    def contact_jacobian(self, position, normal=(0.0, 0.0, 1.0)):
        """Return the Jacobian of the wheels' material at a ground with a normal, rows in world axes."""
        pin.computeJointJacobians(self._model, self._data, position)
        pin.updateFramePlacements(self._model, self._data)
        rows = []
        for leg in range(1, 5):
            frame = self._model.getFrameId(f"wheel_{leg}", pin.FrameType.BODY)
            jacobian = pin.getFrameJacobian(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)
            axle = self._data.oMf[frame].rotation[:, 2]
            down = normal - axle * (axle @ normal)
            arm = -self._radii[0] * down / np.linalg.norm(down) - self._radii[1] * np.array(normal)
            rows.append(jacobian[:3] - pin.skew(arm) @ jacobian[3:])
        return np.vstack(rows)

    def drift(self, velocity, position, step=1e-5):
        ahead, back = (self.contact_jacobian(position + sign * step * velocity) for sign in (1.0, -1.0))
        return (ahead - back) @ velocity / (2.0 * step)

    def tasks(self, q, v):
        """Return the Jacobians and desired accelerations of the tasks, weighted."""
        component = self._component
        size = self._robot.size
        zero = np.zeros(size)
        pin.centerOfMass(self._model, self._data, q, v, zero)
        com_drift = self._data.acom[0].copy()
        com = pin.jacobianCenterOfMass(self._model, self._data, q).copy()
        pin.forwardKinematics(self._model, self._data, q, v, zero)
        frame = self._model.getFrameId("pelvis", pin.FrameType.BODY)
        turn_drift = pin.getFrameClassicalAcceleration(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED).angular
        pin.computeJointJacobians(self._model, self._data, q)
        pin.updateFramePlacements(self._model, self._data)
        turn = pin.getFrameJacobian(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)[3:]
        references = {name: task.reference.value for name, task in component.tasks.items()}
        com_error = references["com"] - self._data.com[0]
        aim = pin.Quaternion(references["base"]).toRotationMatrix()
        turn_error = pin.log3(aim @ self._data.oMf[frame].rotation.T)
        joints = component.tasks["posture"].point.dofs
        moved = np.setdiff1d(joints, self._robot.selectors["wheels"].indices)
        posture = np.eye(size)[moved]
        posture_error = references["posture"][np.isin(joints, moved)] - q[moved]
        rows = []
        desired = []
        for jacobian, error, drift, gain, weight in (
            (com, com_error, com_drift, 8.0, 1.0),
            (turn, turn_error, turn_drift, 8.0, 1.0),
            (posture, posture_error, 0.0, 5.0, SECOND_LEVEL_WEIGHT),
        ):
            rows.append(np.sqrt(weight) * jacobian)
            desired.append(np.sqrt(weight) * (4.0 * gain * (gain * error - jacobian @ v) - drift))
        return np.vstack(rows), np.concatenate(desired)

    def solve(self, bounds):
        """Return accelerations, forces and torques."""
        q, v = self._robot.state.position.copy(), self._robot.state.velocity.copy()
        size = len(q)
        pin.computeAllTerms(self._model, self._data, q, v)
        inertia, bias = self._data.M.copy(), self._data.nle.copy()
        held = self.contact_jacobian(q)
        demanded = -self.drift(v, q) - SETTLE * held @ v
        jacobian, desired = self.tasks(q, v)
        unit = pin.computeTotalMass(self._model) * 9.81 / 4.0
        count = len(held)
        hessian = np.diag([ACCELERATION_WEIGHT] * size + [FORCE_WEIGHT] * count)
        hessian[:size, :size] += jacobian.T @ jacobian
        gradient = np.concatenate((-jacobian.T @ desired, np.zeros(count)))
        dynamics = np.hstack((inertia, -unit * held.T))
        limited = np.flatnonzero(np.isfinite(self._torques[6:])) + 6
        share = FRICTION / np.sqrt(2.0)
        pyramid = np.array([(1, 0, -share), (-1, 0, -share), (0, 1, -share), (0, -1, -share), (0, 0, -1)])
        cones = np.hstack((np.zeros((20, size)), np.kron(np.eye(4), pyramid)))
        matrix = np.vstack((dynamics[limited], cones, dynamics[:6], np.hstack((held, np.zeros((count, count))))))
        torques = self._torques[limited]
        lower = np.concatenate((-torques - bias[limited], np.full(20, -1e30), -bias[:6], demanded))
        upper = np.concatenate((torques - bias[limited], np.zeros(20), -bias[:6], demanded))
        least = np.concatenate((np.maximum(bounds.lower, -1e30), np.full(count, -1e30)))
        largest = np.concatenate((np.minimum(bounds.upper, 1e30), np.full(count, 1e30)))
        sense = np.zeros(len(least) + len(lower), dtype=c_int)
        sense[-6 - count :] = 5
        x, _, flag, _ = daqp.solve(
            hessian,
            gradient,
            np.ascontiguousarray(matrix),
            np.concatenate((largest, upper)),
            np.concatenate((least, lower)),
            sense,
            primal_tol=1e-9,
            dual_tol=1e-12,
        )
        assert flag == 1
        return x[:size], unit * x[size:], dynamics @ x + bias


def test_torques_balance_accelerations_and_forces():
    component = started()
    random = np.random.default_rng(1)
    second = Second(component)
    model, _ = component.model.kinematics.pinocchio
    data = model.createData()
    for _ in range(20):
        draw(component, random)
        cycle(component)
        state = component.model.state
        problem = component.problem
        needed = pin.rnea(model, data, state.position, state.velocity, problem.acceleration)
        given = problem.torque + second.contact_jacobian(state.position).T @ problem.force
        assert not component.is_holding and not problem.torque[:6].any()
        assert np.abs(needed - given).max() < 1e-9


@pytest.mark.parametrize(("spread", "speed", "scale"), [(0.02, 0.02, 1.0), (0.1, 0.3, 0.5)])
def test_torques_are_those_of_a_second_computation(spread, speed, scale):
    """As are the demands: accelerations of tasks, with their drift, and of contacts, which settle."""
    component = started(limits={"torque_scale": scale})
    random = np.random.default_rng(2)
    second = Second(component, scale)
    active = 0
    for _ in range(50):
        draw(component, random, spread, speed)
        cycle(component)
        problem = component.problem
        acceleration, force, torque = second.solve(component.problem.bounds)
        jacobian, desired = second.tasks(component.model.state.position, component.model.state.velocity)
        assert np.abs(component._demand.stack.jacobian - jacobian).max() < 1e-12
        assert np.abs(component._demand.tasks - desired).max() < 1e-8
        assert not component.is_holding
        assert np.abs(problem.torque - torque)[6:].max() < 1e-6
        assert np.abs(problem.acceleration - acceleration).max() < 1e-6 and np.abs(problem.force - force).max() < 1e-6
        active += np.count_nonzero(problem.active)
    assert scale == 1.0 or active > 100


def test_it_stands_on_its_weight():
    component = started()
    cycle(component)
    forces = component.problem.force.reshape(4, 3)
    assert forces[:, 2].sum() == pytest.approx(931.65, abs=0.01)
    assert np.abs(component.problem.acceleration).max() < 0.01 and np.abs(forces[:, :2]).max() < 1.0


def test_a_lifted_contact_fades_and_comes_back():
    component = started(fade=0.1)
    cycle(component)
    before = component.problem.force.copy()
    assert component.lift(LiftContacts(("front_left_leg",))).success
    cycle(component, 10)
    some = component.problem.force[2]
    assert some == pytest.approx(component.ground.largest[0]) == pytest.approx(0.5 * before[2])
    cycle(component, 15)
    assert not component.is_holding and np.abs(component.problem.force[:3]).max() < 1e-9
    assert not component.model.contacts["front_left_leg"].active
    component.lift(LiftContacts(("front_left_leg",), lifted=False))
    cycle(component, 30)
    assert component.problem.force == pytest.approx(before, abs=1e-6)


def test_without_contacts_it_falls():
    component = started(fade=0.0)
    component.lift(LiftContacts())
    cycle(component, 2)
    assert not component.is_holding and not component.problem.force.any()
    component.model.kinematics.update(component.model.state.position)
    fall = component.tasks["com"].point.jacobian @ component.problem.acceleration
    assert fall == pytest.approx((0.0, 0.0, -9.81), abs=1e-3)


def test_joints_brake_before_the_ends_of_their_ranges():
    robot = centauro()
    dof = robot.dof("j_arm1_4")
    limits = {"braking": 10.0, "horizon": 0.02}
    component = started(robot, limits=limits)
    end = robot.lower_limits.position[dof]
    state = robot.state
    state.position[dof], state.velocity[dof] = end + 0.01, -0.6
    posture = component.tasks["posture"]
    posture.reference.value[posture.point.dofs == dof] = end - 1.0
    cycle(component)
    # 0.6 rad/s needs 18 mrad, there are 10: it brakes with all it may
    assert component.problem.acceleration[dof] == pytest.approx(10.0)
    names = [component.problem.names[index] for index in np.flatnonzero(component.problem.active)]
    assert names == ["acceleration of j_arm1_4"]


def jump(component, speed):
    """Let the robot leave the ground, where its legs are to follow."""
    component.model.state.velocity[2] = speed


def test_what_cannot_be_kept_is_named_and_held(caplog):
    robot = centauro()
    component = started(robot, limits={"torque_scale": 0.05})
    robot.state.torque[:] = 3.0
    jump(component, 3.0)
    start = robot.state.position.copy()
    command = cycle(component)
    assert component.is_holding and np.array_equal(command.position, start) and not command.velocity.any()
    assert "friction of rear_right_leg contradicts the others; it holds" in caplog.text
    assert np.abs(command.torque - 3.0)[6:].max() < 5.0  # it passes to the carrying torques
    report = component.topics()[-1].collect()
    assert report.status[0].level == 1 and "rear_right_leg" in report.status[0].message


def test_wrong_states_are_held():
    component = started()
    cycle(component)
    component.model.state.velocity[20] = np.nan
    component.update()
    assert component.is_holding and "not finite" in component.problem.violated


def test_it_goes_on_after_holding():
    component = started(limits={"torque_scale": 0.05})
    cycle(component)
    jump(component, 3.0)
    cycle(component, 100)
    assert component.is_holding
    jump(component, 0.0)
    steps = np.array([cycle(component).torque.copy() for _ in range(60)])
    assert not component.is_holding
    assert np.abs(np.diff(steps, axis=0)).max() < 0.1 * np.abs(steps[-1]).max()


def test_torques_that_do_not_come_are_named_and_held(caplog):
    """Measured torques that follow are none of that; nor is what differs while commands blend in, for 3 s."""
    component = started()
    state = component.model.state
    dof = component.model.dof("hip_pitch_1")
    for wrong, count in ((False, 700), (True, 60)):
        for _ in range(count):
            cycle(component)
            state.torque[:] = component.model.command.torque
            state.torque[dof] *= not wrong
        assert component.is_holding == wrong
    assert re.search(r"joint 'hip_pitch_1' has a torque of .* Nm instead of .* Nm; it holds until", caplog.text)
    component.init()
    cycle(component)
    assert not component.is_holding


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_any_motor_that_is_dead_is_named(sign):
    """Also the weakest one, which cannot do what its friction might be on a robot of that weight."""
    component = started()
    robot = component.model
    watch = component._watch
    for dof in component.efforts:
        watch.start()
        robot.command.torque[:] = 0.1
        robot.command.torque[dof] = sign * 0.5 * robot.kinematics.effort_limit[dof]
        robot.state.torque[:] = robot.command.torque
        robot.state.torque[dof] = 0.0
        for _ in range(900):
            watch.update(1.0 / RATE)
        assert f"joint '{robot.dofs[dof]}'" in watch.fault


@pytest.mark.parametrize(("part", "is_lost"), [(0.0, False), (0.5, False), (1.0, False), (3.0, True)])
def test_dampers_of_the_lower_level_are_no_lost_torque(part, is_lost):
    """They turn joints that move otherwise than commanded: whatever part of that arrives is right, and no more."""
    component = started()
    state = component.model.state
    command = component.model.command
    dof = component.model.dof("j_arm1_1")
    command.add("damping")[dof] = 60.0
    component.init()
    for count, speed in ((700, 0.0), (60, 1.0)):
        for _ in range(count):
            cycle(component)
            state.torque[:] = command.torque
            if speed:
                state.velocity[dof] = command.velocity[dof] - np.sign(command.torque[dof]) * speed
                state.torque[dof] += part * command["damping"][dof] * (command.velocity[dof] - state.velocity[dof])
    assert component.is_holding == is_lost


@pytest.mark.parametrize(("speed", "is_slipping"), [(0.02, False), (0.1, True)])
def test_contacts_that_slip_are_named_and_held(speed, is_slipping, caplog):
    component = started()
    component.model.state.velocity[1] = speed
    cycle(component, 80)
    assert component.is_holding == is_slipping
    assert ("contact 'front_left_leg' slips: it has moved by 2." in caplog.text) == is_slipping


@pytest.mark.slow
@pytest.mark.parametrize("ground", [None, "odometry/ground"])
def test_cycles_keep_no_memory(ground):
    component = started(ground=ground)
    random = np.random.default_rng(5)
    draw(component, random)
    state = component.model.state

    def one():
        state.velocity[0] += 1e-9
        if ground:  # it never comes to rest
            component.ground.cones.felt.normals[:, 0] = 0.1 * math.sin(1e5 * state.velocity[0])
        cycle(component)

    check_that_it_keeps_no_memory(one)


@pytest.mark.parametrize(
    ("tags", "error", "text"),
    [
        ({"track": "torso"}, ComponentError, "no contact of 'torso'"),
        ({"track": "wheel"}, UnknownName, "wheels"),
        ({"speed_driven": "wheel"}, UnknownName, "wheels"),
        ({"tasks": TASKS | {"com": {"point": "center_of_mass", "gain": 60.0}}}, ComponentError, "240 /s of task 'com'"),
        ({"levels": (("com", "base"),)}, ConfigError, "'posture' is in no level"),
    ],
)
def test_mistakes_are_refused(tags, error, text):
    with pytest.raises(error, match=text):
        made(**tags)


def test_a_robot_without_contacts_is_refused():
    with pytest.raises(ComponentError, match=r"no contact of 'wheels' [^$]*contacts: {read: true}"):
        made(centauro(contacts=False))


def test_a_robot_without_mass_is_refused(tmp_path):
    text = URDF.read_text()
    (tmp_path / "ghost.urdf").write_text(re.sub(r"<inertial>.*?</inertial>", "", text, flags=re.DOTALL))
    robot = Robot.load(tmp_path / "ghost.urdf", SRDF, contacts=CONTACTS)
    with pytest.raises(ModelError, match=r"has no mass"):
        made(robot)


@pytest.mark.parametrize(
    ("before", "after", "text"),
    [
        ("  speed_driven: wheels", "  # none", r"effort of 'j_wheel_1' and of 3 more, and no controller carries it"),
        (
            "robot: base_velocity\n      controller: direct\n      secondary_file: {file: support/torques.yaml}",
            "robot: base_velocity\n      controller: direct",
            r"commands the stiffness of joints, and no controller",
        ),
        ("      track: wheels            #", "      track: torso  #", r"no contact of 'torso' carries 'centauro'"),
        ("      friction: 0.8\n      speed", "      friction: -1\n      speed", r"friction"),
    ],
)
def test_mistakes_of_a_configuration_have_their_place(tmp_path, before, after, text):
    file = tmp_path / "centauro.yaml"
    content = (CENTAURO.parents[1] / "centauro.yaml").read_text()
    assert content.count(before) == 1
    file.write_text(content.replace(before, after))
    for folder in ("support", "robots", "references"):
        (tmp_path / folder).symlink_to(CENTAURO.parents[1] / folder)
    errors = check_file(file, ["inverse_dynamics"]).errors
    assert len(errors) == 1 and re.search(text, str(errors[0])) and re.match(r".*centauro.yaml:\d+:\d+", str(errors[0]))


def ideal(component, duration):
    """Let a robot without any error pass some time [s]; return where its centre of mass has been, shape (count, 3)."""
    state = component.model.state
    places = []
    for _ in range(round(duration * RATE)):
        cycle(component)
        places.append(component.tasks["com"].point.value.copy())
        state.velocity += component.problem.acceleration / RATE
        state.position += state.velocity / RATE
    return np.array(places)


def test_references_of_services_and_pipes_are_followed():
    component = started()
    com = component.references.targets["com"]
    start = component.tasks["com"].point.value.copy()
    component.references.interface.set_reference(SetReference("com", (0.0, 0.02, -0.03), relative=True))
    ideal(component, 1.0)
    assert component.tasks["com"].point.value == pytest.approx(start + (0.0, 0.02, -0.03), abs=1e-4)
    component.inputs["com"].value[:] = start
    component.inputs["com"].fresh = True
    ideal(component, 1.0)
    assert component.tasks["com"].point.value == pytest.approx(start, abs=1e-4) and not component.is_holding
    assert (
        component.references.interface.get_reference(GetReference("com")).values == com.desired == pytest.approx(start)
    )


def test_goals_end_with_what_keeps_tasks_away():
    """The posture has the weight of the hand, which it keeps from a goal; the centre of mass reaches its own."""
    hand = {"point": "position", "link": "arm1_7", "gain": 8.0}
    component = started(tasks=TASKS | {"hand": hand}, levels=(("com", "base"), ("posture", "hand")))
    action = component.actions()[0]
    goals = []
    for task, way in (("com", (0.0, 0.0, -0.02)), ("hand", (0.0, 0.0, 0.1))):
        place = component.tasks[task].point.value + way
        action.begin(ReachGoal((task,), (Pose(Vector(*place)),)))
        ideal(component, 1.5)
        goals.append(action.outcome())
    reached, kept = goals
    assert reached.success and not kept.success
    assert re.search(r"hand cannot be reached: it stays 0\.\d* m .*active constraints: none", kept.text)


@pytest.mark.parametrize(
    ("task", "values", "error"), [("cmo", (0.0, 0.0, 0.0), "com"), ("com", (0.0,), "3"), ("com", (np.nan,) * 3, "nan")]
)
def test_wrong_references_change_nothing(task, values, error):
    component = started()
    before = component.references.targets["com"].desired
    with pytest.raises(SolferError, match=error):
        component.references.interface.set_reference(SetReference(task, values))
    assert component.references.targets["com"].desired == before


def test_generated_references_are_followed_with_their_acceleration():
    """A circle of 1 s has 2 m/s2, which gains alone would follow 8 mm behind."""
    circle = {"circle": {"radius": 0.05, "period": 1.0, "plane": "xy"}}
    component = started(tasks=TASKS | {"com": TASKS["com"] | {"reference": circle}})
    com = component.tasks["com"]
    start = component.tasks["com"].point.value.copy()
    ideal(component, 1.0)
    places = ideal(component, 1.0)
    assert component.references.targets["com"].is_generated
    center = places.mean(axis=0)
    assert np.linalg.norm(places - center, axis=1) == pytest.approx(0.05, abs=2e-3)
    assert np.linalg.norm(center - start) == pytest.approx(0.05, abs=2e-3)
    assert np.linalg.norm(com.point.value - com.reference.value) < 2e-3


def test_a_base_that_jumps_changes_no_torque():
    """Two robots do the same; the estimate of the base of one jumps by 36 cm and half a radian."""
    circle = {"circle": {"radius": 0.02, "period": 2.0, "plane": "xy"}}
    pair = [started(tasks=TASKS | {"com": TASKS["com"] | {"reference": circle}}) for _ in range(2)]
    for component in pair:
        ideal(component, 0.4)
    still, moved = pair
    state = moved.model.state
    base = moved.model.kinematics.base
    before, _ = base.to_pose(state.position[:6])
    rotation = base.to_rotation(state.position[:6])
    turn = np.array(((np.cos(0.5), -np.sin(0.5), 0.0), (np.sin(0.5), np.cos(0.5), 0.0), (0.0, 0.0, 1.0)))
    place = before + (0.3, -0.2, 0.0)
    base.from_rotation(place, turn @ rotation, state.position[:6])
    moved.move_world(PlanarMove(before, place, 0.5))
    still.model.state.velocity[3:6], state.velocity[3:6] = 0.0, 0.0
    state.velocity[:3] = turn @ state.velocity[:3]
    torques = [[cycle(component).torque.copy() for _ in range(3)] for component in pair]
    assert np.abs(np.subtract(*torques)).max() < 5.0  # for one cycle the acceleration has the old heading
    assert np.abs(np.subtract(*torques))[1:].max() < 1e-3


def on_slope(degrees, axis="y", **tags):
    """Stand on a plane that is turned about an axis, and has been felt if others feel it; return its normal as well."""
    robot = centauro()
    base = robot.kinematics.base
    turn = Rotation.from_euler(axis, degrees, degrees=True).as_matrix()
    place, _ = base.to_pose(robot.state.position[:6])
    base.from_rotation(turn @ place, turn @ base.to_rotation(robot.state.position[:6]), robot.state.position[:6])
    robot.update()
    component = started(robot, **{"ground": "odometry/ground"} | tags)
    if component.ground.cones.felt:
        feel(component, turn[:, 2])
    cycle(component, 700)
    return component, turn[:, 2]


def feel(component, normal):
    component.ground.cones.felt.receive(GroundEstimate(normal=Vector(*normal)))


@pytest.mark.parametrize("degrees", [10.0, 15.0])
@pytest.mark.parametrize("axis", ["x", "y"])
def test_on_a_slope_forces_are_those_of_statics(degrees, axis):
    """By Pinocchio the forces carry the robot at contacts that are uphill of the wheels' lowest points."""
    component, normal = on_slope(degrees, axis, friction=0.45)
    model, _ = component.model.kinematics.pinocchio
    state = component.model.state
    problem = component.problem
    needed = pin.rnea(model, model.createData(), state.position, state.velocity, problem.acceleration)
    jacobian = Second(component).contact_jacobian(state.position, normal)
    assert not component.is_holding
    assert (jacobian.T @ problem.force)[:6] == pytest.approx(needed[:6], abs=1e-6)
    assert needed - jacobian.T @ problem.force == pytest.approx(problem.torque, abs=1e-6)
    assert problem.force.reshape(-1, 3).sum(axis=0)[2] == pytest.approx(
        9.81 * component.model.kinematics.mass, rel=1e-3
    )
    assert component.ground.normals @ problem.force == pytest.approx(problem.force.reshape(-1, 3) @ normal)


@pytest.mark.parametrize("ground", [None, "odometry/ground"])
def test_on_a_felt_slope_forces_stay_in_real_cones(ground):
    """Forces that balance the weight need tan(20 deg) = 0.36, which vertical cones allow for with less friction."""
    component, normal = on_slope(20.0, friction=0.3, ground=ground)
    forces = component.problem.force.reshape(-1, 3)
    along = np.linalg.norm(forces - np.outer(forces @ normal, normal), axis=1)
    assert (along <= 0.3 * (forces @ normal) + 1e-9).all() == (ground is not None)


def test_torques_do_not_jump_with_the_ground():
    """It tilts by 10 degrees within 0.3 s, and then is where one that has felt it from the start has it."""
    component, _ = on_slope(0.0)
    torques = []
    for step in range(200):
        angle = math.radians(10.0) * min(step / 60.0, 1.0)
        if step % 20 == 0:
            feel(component, (-math.sin(angle), 0.0, math.cos(angle)))
        torques.append(cycle(component).torque.copy())
    assert np.abs(np.diff(torques, axis=0)).max() < 2.0  # [Nm] in a cycle, of a robot of 1.1 kN


def test_without_a_felt_ground_normals_are_those_of_the_file():
    flat, _ = on_slope(0.0)
    known = started()
    assert np.array_equal(cycle(known).torque, cycle(flat).torque)
    assert known.topics()[-2].name != "/odometry/ground" and flat.topics()[-2].name == "/odometry/ground"


def test_a_recording_has_forces_and_active_constraints():
    component = started()
    logger = Logger("dynamics")
    component.start_log(logger)
    cycle(component)
    rows = {source.channel.name.rpartition("/")[2]: source for source in logger.sources}
    assert set(rows) >= {"reference", "residual", "acceleration", "torque", "forces", "active"}
    assert rows["forces"].array[2::3].sum() == pytest.approx(931.65, abs=0.01)

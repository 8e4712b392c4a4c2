"""What the simulated CENTAURO measures, against its own motion, Pinocchio and the laws of mechanics."""

import numpy as np
import pinocchio as pin
import pytest
from support.controllers import accept
from support.integration.world import perfect

from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation import Simulation
from solfer.transport.messages import JointMessage

DT = 0.001  # [s]
WEIGHT = 94.96909 * 9.81  # [N]
WHEELS = tuple(f"j_wheel_{leg}" for leg in (1, 2, 3, 4))
TURN = np.array([4.0, -1.0, 4.0, -1.0])  # wheel speeds of a drive with a turn [rad/s]


@pytest.fixture(scope="module")
def simulation():
    """CENTAURO."""
    simulation = Simulation.from_file(perfect())
    yield simulation
    simulation.close()


@pytest.fixture(scope="module")
def standing():
    """CENTAURO after two seconds in which it stood."""
    simulation = Simulation.from_file(perfect())
    for _ in range(2000):
        simulation.step()
    yield simulation
    simulation.close()


def drive(simulation, steps, push=None):
    """Poses of the IMU, samples of it and of the base at each step; `push` is a force on the pelvis [N] for 0.1 s."""
    kinematics, body = simulation.kinematics, simulation.body
    simulation.reset()
    history = []
    for step in range(steps):
        if step % 10 == 0:
            speed = TURN * min(1.0, step / 500.0)
            simulation.lower_level.accept("velocity_controller", JointMessage(WHEELS, velocity=speed))
        if push is not None and 400 <= step < 500:
            body.robot.push(body.base_link, push, [0.0] * 3, body.position.tolist())
        simulation.step()
        imu, base = simulation.sensors["imu"].measure(), simulation.sensors["base"].measure()
        kinematics.update(simulation.q)
        history.append(
            (
                kinematics.position("imu_link").copy(),
                kinematics.rotation("imu_link").copy(),
                imu.orientation.copy(),
                imu.angular.copy(),
                imu.acceleration.copy(),
                base.position.copy(),
                base.linear.copy(),
                base.angular.copy(),
            )
        )
    return [np.array(column) for column in zip(*history, strict=True)]


@pytest.fixture(scope="module", params=[None, (150.0, 200.0, 0.0)], ids=["turn", "push"])
def driven(simulation, request):
    """Drive with a turn for a second, once with a push."""
    return drive(simulation, 1000, request.param)


def test_at_rest_the_specific_force_points_up(standing):
    imu = standing.sensors["imu"].measure()
    assert imu.frame == "imu_link"
    np.testing.assert_allclose(rotation_from_quaternion(imu.orientation) @ imu.acceleration, [0, 0, 9.81], atol=2e-3)
    np.testing.assert_allclose(imu.angular, 0.0, atol=1e-4)


def test_the_specific_force_is_that_of_the_motion(driven):
    """Second differences of the IMU's place, plus gravity, are the oracle: it must not measure mere acceleration."""
    place, rotation, _, _, acceleration, *_ = driven
    # 50 ms windows: mean acceleration from second differences of the place, with the same weights on the sensor
    window = 50
    for start in range(50, 900, 25):
        times = slice(start, start + window + 1)
        path = place[times]
        moved = (path[-1] - path[-2] - path[1] + path[0]) / DT
        felt = (
            sum(
                r @ f
                for r, f in zip(
                    rotation[start + 2 : start + window + 1], acceleration[start + 2 : start + window + 1], strict=True
                )
            )
            * DT
        )
        np.testing.assert_allclose(felt, moved + np.array([0, 0, 9.81]) * DT * (window - 1), atol=5e-4)
    assert np.abs(acceleration[100:] - [0, 0, 9.81]).max() > 0.3


def test_angular_velocity_and_orientation_follow_the_motion(driven):
    _, rotation, orientation, angular, *_ = driven
    for step in range(100, 999, 7):
        turned = pin.log3(rotation[step].T @ rotation[step + 1]) / DT
        np.testing.assert_allclose(angular[step + 1], turned, atol=2e-4)
        np.testing.assert_allclose(rotation_from_quaternion(orientation[step]), rotation[step], atol=1e-12)
    assert np.abs(angular[:, 2]).max() > 0.05


def test_the_base_twist_is_of_the_motion(driven):
    *_, position, linear, _ = driven
    np.testing.assert_allclose(np.diff(position, axis=0) / DT, linear[1:], atol=2e-3)
    assert np.linalg.norm(linear, axis=1).max() > 0.1


def test_contact_forces_carry_the_weight(standing):
    wrenches = standing.sensors["contacts"].messages()
    total = sum(wrench.force for wrench in wrenches[::2])
    assert total[2] / WEIGHT - 1.0 == pytest.approx(0.0, abs=1e-3)
    np.testing.assert_allclose(total[:2], 0.0, atol=1.0)


def test_contacts_have_frames_and_arms_have_none(standing):
    wrenches = standing.sensors["contacts"].messages()
    assert standing.sensors["contacts"].names[4:] == ("left_arm", "right_arm")
    assert [wrench.frame for wrench in wrenches[:4]] == ["world", "wheel_1", "world", "wheel_2"]
    for wrench in wrenches[8:]:
        assert not wrench.force.any() and not wrench.torque.any()


def test_both_axes_give_the_same_wrench(standing):
    wrenches, kinematics = standing.sensors["contacts"].messages(), standing.kinematics
    kinematics.update(standing.q_before)
    forces = standing.contacts()
    for world, local in zip(wrenches[:8:2], wrenches[1:8:2], strict=True):
        rotation = kinematics.rotation(local.frame)
        np.testing.assert_allclose(rotation @ local.force, world.force, atol=1e-9)
        np.testing.assert_allclose(rotation @ local.torque, world.torque, atol=1e-9)
        np.testing.assert_allclose(world.force, forces[local.frame], atol=1e-9)
        lowest = np.array([0.0, 0.0, -0.078])  # contact point as seen from the centre of the wheel [m]
        np.testing.assert_allclose(world.torque, np.cross(lowest, world.force), atol=0.05)


def test_torques_agree_with_inverse_dynamics(simulation):
    """Pinocchio's rnea; the robot lifts its body and turns its torso slowly."""
    simulation.reset()
    kinematics, controller = simulation.kinematics, simulation.lower_level.controller("position_controller")
    start = controller.target.copy()
    knees = [controller.joints.index(f"knee_pitch_{leg}") for leg in (1, 2, 3, 4)]
    error, effort = np.zeros(kinematics.size), np.zeros(kinematics.size)
    for step in range(1500):
        if step % 5 == 0:
            goal = start.copy()
            goal[knees] += 0.05 * np.sin(0.002 * step) * np.array([1.0, -1.0, -1.0, 1.0])
            goal[controller.joints.index("torso_yaw")] += 0.1 * np.sin(0.002 * step)
            accept(controller, JointMessage(controller.joints, position=goal))
        simulation.step()
        wrenches = simulation.sensors["contacts"].messages()
        if step < 500:
            continue
        q, v = simulation.q_before, simulation.v_before
        expected = pin.rnea(kinematics._model, kinematics._model.createData(), q, v, (simulation.v - v) / DT)
        kinematics.update(q)
        for world, local in zip(wrenches[::2], wrenches[1::2], strict=True):
            expected -= kinematics.jacobian(local.frame).T @ np.concatenate((world.force, world.torque))
        error = np.maximum(error, np.abs(expected - simulation.torque))
        effort = np.maximum(effort, np.abs(simulation.torque))
    assert effort.max() > 20.0  # [Nm]
    for group in (slice(0, 6), slice(6, None)):
        assert error[group].max() < 0.01 * effort.max()


def test_the_motor_side_includes_the_springs_deflection(simulation):
    """Motor and joint encoders differ by torque / stiffness, also in joints too stiff for a second mass."""
    simulation.reset()
    joints, names = slice(6, None), simulation.kinematics.dofs[6:]
    simulation.lower_level.accept("position_controller", JointMessage(("torso_yaw",), position=np.array([0.1])))
    positions, velocities = [], []
    for _ in range(300):
        simulation.step()
        motors = simulation.sensors["motors"].measure()
        positions.append(motors.position.copy())
        velocities.append(motors.velocity.copy())
        np.testing.assert_array_equal(motors.effort, simulation.torque[joints])
    assert motors.names == names
    deflection = motors.position - simulation.q[joints]
    for joint, stiffness in (("knee_pitch_1", 80000.0), ("ankle_yaw_2", 40000.0)):  # too stiff for two masses
        torque = simulation.torque[joints][names.index(joint)]
        assert deflection[names.index(joint)] == pytest.approx(torque / stiffness, rel=1e-9)
    # a velocity is the derivative of a position, for the motor as for the joint
    np.testing.assert_allclose(np.diff(positions, axis=0) / DT, velocities[1:], atol=1e-6)


def test_springs_at_rest_carry_their_torque(standing):
    motors, joints = standing.sensors["motors"].measure(), standing.sensors["joints"].measure()
    deflection = dict(zip(motors.names, motors.position - joints.position, strict=True))
    torque = dict(zip(joints.names, joints.effort, strict=True))
    for joint, stiffness in (("knee_pitch_1", 80000.0), ("j_arm1_1", 6000.0), ("hip_pitch_2", 80000.0)):
        assert abs(torque[joint]) > 1.0
        assert deflection[joint] == pytest.approx(torque[joint] / stiffness, rel=0.1)

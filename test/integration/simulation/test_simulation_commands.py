"""A command that is refused moves nothing at all."""

from pathlib import Path

import numpy as np
import pytest

from solfer.errors import CommandRefused, ModelError, SolferError, UnknownName
from solfer.simulation import Simulation
from solfer.transport.messages import JointMessage

ROBOT = Path(__file__).resolve().parents[3] / "config/robots/centauro/robot.yaml"
STEPS = 30


def bad_commands(simulation):
    """List controller and command, of every kind that is refused; each has a part that would be right alone."""
    legs, wheels = "position_controller", "velocity_controller"
    effort = simulation.lower_level.controller(legs).limits.effort[0]
    return [
        (legs, JointMessage(("torso_yaw", "hip_yaw_1"), position=np.array([0.5, np.nan]))),
        (legs, JointMessage(("torso_yaw", "hip_yaw_1"), position=np.array([0.5, 9.0]))),
        (legs, JointMessage(("torso_yaw", "hip_yaw_9"), position=np.array([0.5, 0.1]))),
        (legs, JointMessage(("torso_yaw", "torso_yaw"), position=np.array([0.5, 0.5]))),
        (legs, JointMessage(("torso_yaw", "j_wheel_1"), position=np.array([0.5, 0.1]))),
        (legs, JointMessage(("torso_yaw", "hip_yaw_1"), position=np.array([0.5]))),
        (legs, JointMessage(("torso_yaw",), position=np.array([0.5]), effort=np.array([10.0 * effort]))),
        (legs, JointMessage(("torso_yaw",), position=np.array([0.5]), stiffness=np.array([-1.0]))),
        (legs, JointMessage(("torso_yaw",), position=np.array([0.5]), stiffness=np.array([1e300]))),
        (wheels, JointMessage(("j_wheel_1", "j_wheel_2"), velocity=np.array([1.0, np.inf]))),
        (wheels, JointMessage(("j_wheel_1", "j_wheel_2"), velocity=np.array([1.0, 1e3]))),
        (wheels, JointMessage(("j_wheel_1",), velocity=np.array([1.0]), position=np.array([0.0]))),
    ]


def test_refused_commands_leave_the_motion_bitwise_equal():
    simulation, untouched = Simulation.from_file(ROBOT), Simulation.from_file(ROBOT)
    commands = bad_commands(simulation)
    for _ in range(STEPS):
        for controller, message in commands:
            with pytest.raises(CommandRefused):
                simulation.lower_level.accept(controller, message)
        simulation.step()
        untouched.step()
        np.testing.assert_array_equal(simulation.q, untouched.q)
        np.testing.assert_array_equal(simulation.torque, untouched.torque)
    assert simulation.lower_level.refused == STEPS * len(commands)
    simulation.close()
    untouched.close()


def test_a_wrong_state_is_refused():
    with pytest.raises(UnknownName, match="unknown state 'mammal_wide_streight'") as error:
        Simulation.from_file(ROBOT, state="mammal_wide_streight")
    assert "mammal_wide_straight" in error.value.names
    simulation = Simulation.from_file(ROBOT)
    with pytest.raises(ModelError, match="state 'upper_back' has joint"):
        simulation.reset("upper_back")
    simulation.close()


def test_a_leg_state_leaves_the_arms():
    simulation = Simulation.from_file(ROBOT)
    arms = [index for index, name in enumerate(simulation.kinematics.dofs) if name.startswith("j_arm")]
    before = simulation.q[arms].copy()
    simulation.reset("ramp_1")
    np.testing.assert_array_equal(simulation.q[arms], before)
    assert np.abs(before).max() > 0.1
    simulation.close()


def test_a_file_that_is_no_bundle(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text("name: centauro\nurfd: centauro.urdf\n")
    with pytest.raises(SolferError) as error:
        Simulation.from_file(file)
    assert "urfd" in str(error.value) and "urdf" in str(error.value) and "robot.yaml:2" in str(error.value)

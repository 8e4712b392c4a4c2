"""Encoders and torque sensors at the motor side of the joints' springs."""

from typing import Any

import numpy as np

from solfer.simulation.physics import STEP
from solfer.simulation.sensors.equipment import Equipment
from solfer.simulation.sensors.sensor import SingleSensor
from solfer.simulation.state import MotorSide, SimulationState
from solfer.transport.messages import JOINT_MESSAGES, JointMessage


class MotorSensors(SingleSensor):
    """Positions and velocities at the motor side of all joints, as seen behind the gear, and torques of the springs.

    Where a spring only yields, with the compliance c, position and velocity follow from the joint's own and from the
    torque tau over the newest step: q + c tau and v + c (tau - tau_before) / dt. Without a spring c is zero.

    Args:
        state: What the robot does.
        motors: What its motors do.
    """

    name = "motors"
    topic = "motor_states"
    message = "sensor_msgs/JointState"
    what = "motor side of the joints"

    def __init__(self, state: SimulationState, motors: MotorSide):
        super().__init__(state)
        self._message: Any = JointMessage.empty(state.joints, JOINT_MESSAGES[self.message])
        now = state.now
        before = state.before
        self._links = tuple(state.of_joints(numbers) for numbers in (now.q, now.v, now.torque, before.torque))
        self._motors = tuple(
            state.of_joints(numbers)
            for numbers in (motors.two_mass, motors.position, motors.velocity, motors.compliance)
        )

    @classmethod
    def of(cls, state: SimulationState, equipment: Equipment) -> "MotorSensors | None":
        """See `Sensor.of`."""
        return None if state.motors is None else cls(state, state.motors)

    def measure(self) -> JointMessage:
        """Take one sample; the message is the same object each time."""
        (q, v, torque, before), message = self._links, self._message
        two_mass, position, velocity, compliance = self._motors
        message.stamp = self.state.time
        message.position[:] = q + compliance * torque
        message.velocity[:] = v + compliance * (torque - before) / STEP
        message.effort[:] = torque
        np.copyto(message.position, position, where=two_mass)
        np.copyto(message.velocity, velocity, where=two_mass)
        return message

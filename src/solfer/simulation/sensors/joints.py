"""Encoders and torque sensors of the joints, and the motor side of their springs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from solfer.model.actuators import Actuators
from solfer.simulation.sensors.noise import Noise
from solfer.simulation.sensors.records import JointNoiseRecord
from solfer.simulation.world.engine import STEP
from solfer.transport.messages import JointMessage

if TYPE_CHECKING:
    from solfer.simulation.simulation import Simulation

FIELDS = ("position", "velocity", "effort")


class JointSensors:
    """Positions, velocities and torques at the link side of all joints.

    Args:
        simulation: The robot.
        deviations: Standard deviations of their noise.
        seed: Seed of their noise.
    """

    def __init__(self, simulation: Simulation, deviations: JointNoiseRecord, seed: int):
        self._simulation, self._noise = simulation, Noise(seed, "joints")
        self._deviations = [(field, getattr(deviations, field)) for field in FIELDS if getattr(deviations, field)]
        self._message = JointMessage.empty(simulation.body.joints, FIELDS)

    def restart(self, seed: int | None = None) -> None:
        """Begin the noise anew, or that of another seed."""
        self._noise.restart(seed)

    def measure(self) -> JointMessage:
        """Take one sample; the message is the same object each time."""
        truth = self._simulation.joint_message()
        if not self._deviations:
            return truth
        message = self._message
        message.stamp = truth.stamp
        for field in FIELDS:
            getattr(message, field)[:] = getattr(truth, field)
        for field, deviation in self._deviations:
            self._noise.add(getattr(message, field), deviation)
        return message


class MotorSensors:
    """Positions, velocities and torques at the motor side of all joints, as seen behind the gear.

    The spring of a series elastic joint carries the torque of the joint: q_motor = q + tau / K. The velocity follows
    from the spring's deflection over the newest step, v_motor = v + (tau - tau_before) / (K dt). The spring's own
    damping is left out, its time constant D / K is far below a step. A joint without a spring is rigid.

    Args:
        simulation: The robot.
        actuators: Its springs; `dofs` are the joints of the robot's body.
    """

    def __init__(self, simulation: Simulation, actuators: Actuators):
        self._simulation = simulation
        stiffness = actuators.stiffness
        self._compliance = np.divide(1.0, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
        self._joints = slice(simulation.kinematics.size - len(stiffness), None)
        self._message: Any = JointMessage.empty(actuators.dofs, FIELDS)

    def measure(self) -> JointMessage:
        """Take one sample; the message is the same object each time."""
        simulation, joints, message = self._simulation, self._joints, self._message
        torque, before = simulation.torque[joints], simulation.torque_before[joints]
        message.stamp = simulation.time
        message.position[:] = simulation.q[joints] + self._compliance * torque
        message.velocity[:] = simulation.v[joints] + self._compliance * (torque - before) / STEP
        message.effort[:] = torque
        return message

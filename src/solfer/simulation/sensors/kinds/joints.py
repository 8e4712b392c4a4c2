"""Encoders and torque sensors at the link side of the joints."""

from typing import Any

import numpy as np
from pydantic import Field

from solfer.config import Record
from solfer.config.records.bounds import NOISE
from solfer.simulation.sensors.equipment import Equipment
from solfer.simulation.sensors.noise import Noise
from solfer.simulation.sensors.sensor import SingleSensor
from solfer.simulation.state import SimulationState
from solfer.transport.messages import JOINT_MESSAGES, JointMessage


class JointNoiseRecord(Record):
    """Standard deviations of one sample of a joint state, and errors that last."""

    position: float = Field(default=0.0, **NOISE, description="[rad, m]")
    velocity: float = Field(default=0.0, **NOISE, description="[rad/s, m/s]")
    effort: float = Field(default=0.0, **NOISE, description="[Nm, N]")
    effort_offset: float = Field(
        default=0.0, **NOISE, description="largest offset of a torque sensor, between - and + of it by seed [Nm, N]"
    )
    resolution: float | None = Field(
        default=None,
        ge=1e-9,  # the largest positions are still whole numbers of steps
        le=1e4,
        description="step of positions, default: none; 9.58738e-5: 16 bits a revolution [rad, m]",
    )
    exact: bool = Field(default=False, description="leaves out all of these")


class JointSensors(SingleSensor):
    """Positions, velocities and torques at the link side of all joints.

    Args:
        state: What the robot does.
        deviations: Standard deviations of their noise.
        seed: Seed of their noise.
    """

    name = "joints"
    topic = "joint_states"
    message = "sensor_msgs/JointState"
    what = "joint states"
    tags = {
        "joint_noise": (
            JointNoiseRecord,
            Field(default_factory=JointNoiseRecord, description="noise of joint states"),
        )
    }

    def __init__(self, state: SimulationState, deviations: JointNoiseRecord, seed: int):
        super().__init__(state, seed)
        self._deviations = deviations = JointNoiseRecord() if deviations.exact else deviations
        self._offsets = Noise(seed, "torque offsets")
        self._offset = np.zeros(len(state.joints))
        self._offsets.spread(self._offset, deviations.effort_offset)
        self._message: Any = JointMessage.empty(state.joints, JOINT_MESSAGES[self.message])
        now = state.now
        self._truth = tuple(state.of_joints(numbers) for numbers in (now.q, now.v, now.torque))

    @classmethod
    def of(cls, state: SimulationState, equipment: Equipment) -> "JointSensors":
        """See `Sensor.of`."""
        return cls(state, equipment.record.joint_noise, equipment.record.seed)

    def measure(self) -> JointMessage:
        """Take one sample; the message is the same object each time."""
        message = self._message
        deviations = self._deviations
        message.stamp = self.state.time
        message.position[:], message.velocity[:], message.effort[:] = self._truth
        self.noise.add(message.position, deviations.position)
        self.noise.add(message.velocity, deviations.velocity)
        self.noise.add(message.effort, deviations.effort)
        if deviations.effort_offset:
            message.effort += self._offset
        if deviations.resolution is not None:
            message.position[:] = deviations.resolution * np.round(message.position / deviations.resolution)
        return message

    def restart(self, seed: int | None = None) -> None:
        """See `Sensor.restart`."""
        super().restart(seed)
        self._offsets.restart(seed)
        self._offsets.spread(self._offset, self._deviations.effort_offset)

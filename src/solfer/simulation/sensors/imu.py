"""An inertial measurement unit: orientation, angular velocity and specific force."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from solfer.numerics.rotations import quaternion_from_rotation, rotation_from_quaternion
from solfer.simulation.sensors.noise import Noise
from solfer.simulation.sensors.records import ImuRecord
from solfer.simulation.world.engine import STEP
from solfer.transport.messages import ImuMessage

if TYPE_CHECKING:
    from solfer.simulation.simulation import Simulation


class Imu:
    """An inertial measurement unit that is fixed to a link; it measures in the sensor's own axes.

    These are the link's, and the sensor is at its origin, unless the record mounts it otherwise. The specific force is
    R^T (a - g) of the sensor; a is the mean acceleration over the newest step, from the velocities at its beginning and
    at its end. Before the first step a is zero.

    Args:
        simulation: The robot.
        record: The sensor.
        seed: Seed of its noise.

    Raises:
        UnknownName: The robot has no such link.
    """

    def __init__(self, simulation: Simulation, record: ImuRecord, seed: int):
        self._simulation, self._link = simulation, record.link
        self._kinematics = simulation.kinematics
        self._kinematics.frame(record.link, record.where("link"))
        place, turn = record.offset_position, record.offset_orientation
        self._place = np.zeros(3) if place is None else place.vector()
        self._turn = np.eye(3) if turn is None else turn.matrix()
        self._noise, self._deviations = Noise(seed, "imu"), record.noise
        self._angular_bias, self._acceleration_bias = np.array(record.bias.angular), np.array(record.bias.acceleration)
        deviations = (record.noise.orientation, record.noise.angular, record.noise.acceleration)
        self._message = ImuMessage(record.link, deviations=deviations)

    def restart(self, seed: int | None = None) -> None:
        """Begin the noise anew, or that of another seed."""
        self._noise.restart(seed)

    def measure(self) -> ImuMessage:
        """Take one sample; the message is the same object each time."""
        simulation, kinematics = self._simulation, self._kinematics
        kinematics.update(simulation.q_before, simulation.v_before)
        before = self._velocity()[:3]
        kinematics.update(simulation.q, simulation.v)
        velocity, rotation = self._velocity(), kinematics.rotation(self._link) @ self._turn
        message, deviations = self._message, self._deviations
        message.stamp = simulation.time
        message.angular[:] = velocity[3:] @ rotation + self._angular_bias
        acceleration = (velocity[:3] - before) / STEP - kinematics.gravity
        message.acceleration[:] = acceleration @ rotation + self._acceleration_bias
        self._noise.add(message.angular, deviations.angular)
        self._noise.add(message.acceleration, deviations.acceleration)
        message.orientation[:] = quaternion_from_rotation(self._turned(rotation))
        return message

    def _velocity(self) -> np.ndarray:
        """Compute the velocity of the sensor and its angular velocity in world axes, shape (6,)."""
        velocity = self._kinematics.velocity(self._link)
        velocity[:3] += np.cross(velocity[3:], self._kinematics.rotation(self._link) @ self._place)
        return velocity

    def _turned(self, rotation: np.ndarray) -> np.ndarray:
        """Add noise to a rotation, a small turn about axes of the sensor."""
        if not self._deviations.orientation:
            return rotation
        turn = np.zeros(3)
        self._noise.add(turn, self._deviations.orientation)
        return rotation @ rotation_from_quaternion((*(0.5 * turn), 1.0))

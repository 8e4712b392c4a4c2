"""An inertial measurement unit: orientation, angular velocity and specific force."""

import math
from typing import Annotated

import numpy as np
from pydantic import Field

from solfer.config import Record
from solfer.config.records.bounds import NOISE, Bounds, Name
from solfer.config.records.conventions import OffsetOrientationRecord, OffsetPositionRecord
from solfer.numerics.rotations import cross, quaternion_from_rotation, rotation_from_quaternion
from solfer.simulation.physics import STEP
from solfer.simulation.sensors.attitude import AttitudeFilter
from solfer.simulation.sensors.drift import Drift
from solfer.simulation.sensors.equipment import Equipment
from solfer.simulation.sensors.sensor import SingleSensor
from solfer.simulation.state import Moment, SimulationState
from solfer.transport.messages import ImuMessage

_Bias = Annotated[float, Field(ge=-NOISE["le"], le=NOISE["le"])]
Bias = tuple[_Bias, _Bias, _Bias]
FILTER_TIME: Bounds = {"ge": 0.01, "le": 3600.0}
"""Times of the filter [s]."""


class ImuNoiseRecord(Record):
    """Standard deviations of one sample of an inertial measurement unit, for each axis."""

    orientation: float = Field(default=0.0, **NOISE, description="[rad]")
    angular: float = Field(default=0.0, **NOISE, description="[rad/s]")
    acceleration: float = Field(default=0.0, **NOISE, description="[m/s^2]")


class ImuBiasRecord(Record):
    """Bias that an inertial measurement unit adds to each sample, in its own axes."""

    angular: Bias = Field(default=(0.0, 0.0, 0.0), description="[rad/s]")
    acceleration: Bias = Field(default=(0.0, 0.0, 0.0), description="[m/s^2]")


class DriftRecord(Record):
    """Errors of gyroscopes or accelerometers, for each axis, in their unit: rad/s or m/s^2."""

    density: float = Field(
        default=0.0, **NOISE, description="density of white noise, equal at all rates [unit/sqrt(Hz)]"
    )
    bias: float = Field(default=0.0, **NOISE, description="standard deviation of the bias at switching on [unit]")
    walk: float = Field(default=0.0, **NOISE, description="random walk of the bias [unit/sqrt(s)]")


class AttitudeRecord(Record):
    """The filter that computes an orientation from gyroscopes and accelerometers."""

    time_constant: float = Field(default=2.0, **FILTER_TIME, description="time in which a wrong tilt decays [s]")
    bias_time: float = Field(default=30.0, **FILTER_TIME, description="time in which a bias of tilt is learned [s]")


class ImuRecord(Record):
    """An inertial measurement unit."""

    link: Name = Field(description="link with the sensor's frame")
    offset_position: OffsetPositionRecord | None = Field(
        default=None, description="where it really sits on the link (default: at its origin)"
    )
    offset_orientation: OffsetOrientationRecord | None = Field(
        default=None, description="how it is really oriented on the link (default: as its frame)"
    )
    noise: ImuNoiseRecord = Field(default_factory=ImuNoiseRecord, description="standard deviations of one sample")
    bias: ImuBiasRecord = Field(default_factory=ImuBiasRecord, description="what is added to each sample")
    gyroscope: DriftRecord = Field(default_factory=DriftRecord, description="errors of a real gyroscope [rad/s]")
    accelerometer: DriftRecord = Field(
        default_factory=DriftRecord, description="errors of a real accelerometer [m/s^2]"
    )
    attitude: AttitudeRecord | None = Field(
        default=None,
        description="filter that computes the orientation from the sensor's own samples: its heading drifts; default: "
        "the true orientation with its noise",
    )
    exact: bool = Field(default=False, description="leaves out noise, biases, other errors and the filter")

    def effective(self) -> "ImuRecord":
        """Return the record, without errors if it is `exact`."""
        if not self.exact:
            return self
        return ImuRecord(
            link=self.link, offset_position=self.offset_position, offset_orientation=self.offset_orientation
        )


class Imu(SingleSensor):
    """An inertial measurement unit that is fixed to a link; it measures in the sensor's own axes.

    These are the link's, and the sensor is at its origin, unless the record mounts it otherwise. The specific force is
    R^T (a - g) of the sensor; a is the mean acceleration over the newest step, from the velocities at its beginning and
    at its end. Before the first step a is zero.

    Args:
        state: What the robot does.
        record: The sensor.
        seed: Seed of its noise.
        period: Time for which the first sample stands [s]; each further one stands for the time since the one before.

    Raises:
        UnknownName: The robot has no such link.
    """

    name = "imu"
    message = "sensor_msgs/Imu"
    what = "inertial measurement unit"
    tags = {"imu": (ImuRecord | None, Field(default=None, description="inertial measurement unit"))}

    def __init__(self, state: SimulationState, record: ImuRecord, seed: int, period: float = STEP):
        super().__init__(state, seed)
        self._link = record.link
        state.now.require(record.link, record.where("link"))
        record = record.effective()
        position = record.offset_position
        orientation = record.offset_orientation
        self._position = np.zeros(3) if position is None else position.vector()
        self._is_away = bool(self._position.any())
        self._rotation = np.eye(3) if orientation is None else orientation.matrix()
        self._deviations = record.noise
        self._angular_bias = np.array(record.bias.angular)
        self._acceleration_bias = np.array(record.bias.acceleration)
        self._gyroscope = _drift(seed, "gyroscope", record.gyroscope)
        self._accelerometer = _drift(seed, "accelerometer", record.accelerometer)
        self._attitude = None if record.attitude is None else AttitudeFilter(**dict(record.attitude))
        self._period = period
        self._time = -1.0
        self._message = ImuMessage(record.link)

    @classmethod
    def of(cls, state: SimulationState, equipment: Equipment) -> "Imu | None":
        """See `Sensor.of`."""
        record = equipment.record.imu
        return (
            None
            if record is None
            else cls(state, record, equipment.record.seed, period=1.0 / equipment.record.rates.imu)
        )

    def restart(self, seed: int | None = None) -> None:
        """See `Sensor.restart`; the sensor is switched on again."""
        super().restart(seed)
        self._gyroscope.restart(seed)
        self._accelerometer.restart(seed)
        self._time = -1.0

    def measure(self) -> ImuMessage:
        """Take one sample; the message is the same object each time."""
        now = self.state.now
        before = self._velocity(self.state.before)[:3]
        velocity = self._velocity(now)
        rotation = now.rotation(self._link) @ self._rotation
        message = self._message
        deviations = self._deviations
        message.stamp = self.state.time
        message.angular[:] = velocity[3:] @ rotation + self._angular_bias
        acceleration = (velocity[:3] - before) / STEP - now.gravity
        message.acceleration[:] = acceleration @ rotation + self._acceleration_bias
        self.noise.add(message.angular, deviations.angular)
        self.noise.add(message.acceleration, deviations.acceleration)
        passed = STEP * round((message.stamp - self._time) / STEP) if self._time >= 0.0 else 0.0
        self._add_errors(passed)
        message.orientation[:] = quaternion_from_rotation(self._with_noise(self._estimate(rotation, passed)))
        self._time = message.stamp
        return message

    def _add_errors(self, passed: float) -> None:
        """Add the errors of gyroscopes and accelerometers; no time passes in a pause, in which biases stay."""
        message = self._message
        white = self._deviations
        period = passed or self._period
        for drift, values in ((self._gyroscope, message.angular), (self._accelerometer, message.acceleration)):
            drift.wander(passed)
            drift.add(values, period)
        message.deviations = (
            white.orientation,
            math.hypot(white.angular, self._gyroscope.deviation(period)),
            math.hypot(white.acceleration, self._accelerometer.deviation(period)),
        )

    def _estimate(self, rotation: np.ndarray, passed: float) -> np.ndarray:
        """Return the rotation that the sensor estimates from its own samples; it begins with the true heading."""
        if self._attitude is None:
            return rotation
        if self._time < 0.0:
            self._attitude.start(rotation, self._message.acceleration)
        elif passed > 0.0:
            self._attitude.update(self._message.angular, self._message.acceleration, passed)
        return self._attitude.rotation

    def _velocity(self, moment: Moment) -> np.ndarray:
        """Compute the velocity of the sensor and its angular velocity in world axes, shape (6,)."""
        velocity = moment.velocity(self._link)
        if self._is_away:
            velocity[:3] += cross(velocity[3:], moment.rotation(self._link) @ self._position)
        return velocity

    def _with_noise(self, rotation: np.ndarray) -> np.ndarray:
        """Add noise to a rotation, a small rotation about axes of the sensor."""
        if not self._deviations.orientation:
            return rotation
        vector = np.zeros(3)
        self.noise.add(vector, self._deviations.orientation)
        return rotation @ rotation_from_quaternion((*(0.5 * vector), 1.0))


def _drift(seed: int, sensor: str, record: DriftRecord) -> Drift:
    return Drift(seed, sensor, record.density, bias=record.bias, walk=record.walk)

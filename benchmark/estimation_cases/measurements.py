"""What sensors with errors measure of a log."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from estimation_cases.log import PERIOD, ROBOT, Log

from solfer.simulation.bundle import load_bundle, read_bundle
from solfer.simulation.sensors.kinds.imu import Imu
from solfer.simulation.sensors.kinds.joints import JointSensors
from solfer.simulation.sensors.records import SensorsRecord
from solfer.simulation.state import Moment, SimulationState
from solfer.transport.messages import ImuMessage, JointMessage, copied

RADII = 0.003
"""Largest error of a radius that is believed, as a share."""


class Truth(NamedTuple):
    """What the base does: position of the pelvis [m], its rotation to the world, its velocity, shape (6,)."""

    position: np.ndarray
    rotation: np.ndarray
    velocity: np.ndarray


class Sample(NamedTuple):
    """A cycle of estimators: its time [s], what reaches them then, and the truth."""

    time: float
    joints: JointMessage
    imu: ImuMessage
    truth: Truth
    force: np.ndarray


class _Before:
    """What a log knows of the beginning of a step: the velocity of the IMU."""

    def __init__(self) -> None:
        self.imu = np.zeros(6)

    def velocity(self, _: str) -> np.ndarray:
        """Return the velocity of the IMU's link, shape (6,); a new array."""
        return self.imu.copy()

    def rotation(self, _: str) -> np.ndarray:
        """Return no rotation, shape (3, 3): the shipped sensor is at the origin of its link."""
        return np.eye(3)


class Measurements:
    """What the shipped sensors measure of a log, with errors of a seed times a factor.

    The wheels' radii that are believed differ from the true ones by up to 0.3 percent times the factor; with the seed
    of the log and the factor 1 they are those of the robot's files.

    Args:
        log: The log.
        seed: Seed of all errors.
        noise: Their factor; 0: none.
        period: Time from a sample of the IMU to the next [s].

    Attributes:
        radii: Radii that are believed, shape (4,) [m].
    """

    def __init__(self, log: Log, seed: int, noise: float, period: float = PERIOD):
        self._log, self._late = log, 1 if noise else 0
        drawn = np.random.default_rng(seed).uniform(-1.0, 1.0, 4)
        self.radii = log.radii / (1.0 + noise * RADII * drawn)
        kinematics = load_bundle(ROBOT / "robot.yaml").kinematics
        q, v, torque = (np.zeros(kinematics.size) for _ in range(3))
        self._now, self._before, self._time = Moment(kinematics, q, v, torque), _Before(), 0.0
        self._numbers = ((log.position, q), (log.velocity, v), (log.torque, torque))
        owner = {name: name for name in ("pelvis", "imu_link")}
        joints = tuple(kinematics.dofs[6:])
        before: Moment = self._before  # type: ignore[assignment]
        state = SimulationState(joints, owner, None, self._now, before, lambda: [], lambda: self._time)
        record = sensors(seed, noise)
        self._joints = JointSensors(state, record.joint_noise, seed)
        assert record.imu is not None
        self._imu = Imu(state, record.imu, seed, period)

    def __iter__(self) -> Iterator[Sample]:
        """Measure row by row; measurements with errors are 2 ms late, which is a cycle at this rate."""
        last: tuple[JointMessage, ImuMessage] | None = None
        for row, time in enumerate(self._log.time.tolist()):
            self.look(row)
            measured = self.joints(), self.imu()
            sent = last if self._late and last is not None else measured
            last = measured
            yield Sample(time, *sent, self.truth(), self._log.force[row])

    def look(self, row: int) -> None:
        """Go on to a row of the log."""
        self._time, self._before.imu = float(self._log.time[row]), self._log.before[row]
        for logged, numbers in self._numbers:
            numbers[:] = logged[row]
        self._now.expire()

    def joints(self) -> JointMessage:
        """Measure the joints; return a new message."""
        return copied(self._joints.measure())

    def imu(self) -> ImuMessage:
        """Measure with the IMU, whose errors go on with each of its samples; return a new message."""
        return copied(self._imu.measure())

    def truth(self) -> Truth:
        """Return what the base does."""
        now = self._now
        return Truth(np.array(now.position("pelvis")), np.array(now.rotation("pelvis")), now.velocity("pelvis"))


def sensors(seed: int, noise: float) -> SensorsRecord:
    """Return the shipped sensors with errors times a factor."""
    shipped = read_bundle(ROBOT / "robot.yaml").sensors
    made = shipped.model_dump(exclude_unset=True)
    for name in ("imu", "joint_noise"):
        made[name]["exact"] = noise == 0.0
    for drift in ("gyroscope", "accelerometer"):
        made["imu"][drift] = {key: noise * value for key, value in made["imu"][drift].items()}
    for error in ("effort", "effort_offset"):
        made["joint_noise"][error] *= noise
    return SensorsRecord.model_validate(made | {"seed": seed, "delay": 0.002 if noise else 0.0})

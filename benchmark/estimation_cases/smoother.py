"""A batch smoother, which knows past and future, beside what odometry knows."""

import math
from pathlib import Path

import numpy as np
from estimation_cases.baseline import WheeledBody
from estimation_cases.batch import Errors, Intervals, estimate
from estimation_cases.measurements import Sample
from estimation_cases.methods import BIAS, GYROSCOPE, RADIUS, WALK

from solfer.components.odometry.filter import SHAKE_RATIO
from solfer.numerics.rotations import rotation_from_quaternion

CYCLES = 10
"""Measurements from a key frame to the next."""
SHAKING_TIME = 0.3
"""For how long a base shakes as it does [s], of `odometry`."""
WHEEL = 0.078
"""Radius of a wheel [m]."""
RESTS = 0.006
"""Mean speed of all joints within an interval below which the robot rests [rad/s]: three steps of the encoders."""
SLIP_SHARE, ENCODERS, RESTING = 0.008, 2e-3, 1e-5
"""Deviation of a wheel's velocity in one measurement: as a share of it, besides, and at rest [m/s]; of `odometry`."""


class Smoother:
    """The poses of a base for which all measurements of a log together are the most probable.

    Wheels and gyroscope are measured as `odometry` does, with the same deviations: a wheel at r whose joints move by dq
    measures the way -(J dq + p x r) of the base, which tilts by p. The floor is level: the plane through the contacts
    that touch is horizontal, which shows the IMU's error of the tilt, and the base is above it. Measurements between
    key frames are added up in the heading frame in the middle, as far as the gyroscope knows it: its bias turns that by
    0.1 mrad. `batch.estimate` has the unknowns and the equations. It does not fit slopes and transports with faults.

    Args:
        contacts: See `WheeledBody`.
        sample: The first cycle.
        noise: Factor of the sensors' errors.
    """

    def __init__(self, contacts: Path, sample: Sample, noise: float = 1.0):
        self.body, factor = WheeledBody(contacts), max(noise, 1e-3)
        self._errors = Errors(factor * GYROSCOPE, factor * BIAS, factor * WALK, factor * RADIUS)
        self._correction = np.zeros(2)
        self._poses: list[np.ndarray] = []
        self._rows: list[tuple] = []
        self._before: tuple | None = None
        for _ in range(3):  # an error of the tilt is small, but not its square
            self._place(sample)
            self._correct()

    @property
    def pose(self) -> np.ndarray:
        """x, y, z and heading of this cycle, shape (4,) [m, rad]: NaN, until `smooth` writes it."""
        return self._poses[-1]

    def cycle(self, sample: Sample, forces: np.ndarray) -> None:
        """Keep what was measured; forces are normal ones on the wheels, shape (4,) [N]."""
        body = self.body
        body.touch(forces)
        self._poses.append(np.full(4, math.nan))
        rotation = self._place(sample)
        self._correct()
        rate = float((rotation @ body.to_imu @ sample.imu.angular)[2])
        arms, jacobian, position = body.arms.copy(), body.jacobian.copy(), body.position.copy()
        now = (sample.joints.stamp, rate, rotation, arms, jacobian, position)
        touching = body.touching if np.count_nonzero(body.touching) > 1 else np.ones(4, dtype=bool)
        height = -float(arms[touching, 2].mean())
        self._rows.append((*self._measure(self._before or now, now), touching.copy(), height, position))
        self._before = now

    def _place(self, sample: Sample) -> np.ndarray:
        """Place the body as it is seen from its heading; return its rotation to there, shape (3, 3)."""
        rotation = self._level(rotation_from_quaternion(sample.imu.orientation) @ self.body.to_imu.T)
        self.body.place(rotation, sample.joints)
        return rotation

    def _level(self, rotation: np.ndarray) -> np.ndarray:
        """Return the rotation from the base to the heading frame, of one to the world with an error of the tilt."""
        half = 0.5 * math.atan2(rotation[1, 0], rotation[0, 0])
        x, y = 0.5 * self._correction
        levelled = rotation_from_quaternion((0.0, 0.0, -math.sin(half), math.cos(half))) @ rotation
        return rotation_from_quaternion((x, y, 0.0, math.sqrt(1.0 - x * x - y * y))) @ levelled

    def _correct(self) -> None:
        """Let the plane through the contacts be level at the next cycle."""
        places = self.body.arms[self.body.touching]
        if len(places) < 3:
            return
        along, across = np.linalg.lstsq(np.column_stack((places[:, :2], np.ones(len(places)))), places[:, 2])[0][:2]
        self._correction += (-across, along)

    @staticmethod
    def _measure(before: tuple, now: tuple) -> tuple[float, float, np.ndarray, np.ndarray, np.ndarray]:
        """Return the time [s], the turn [rad], ways of the ground point by each wheel, arms, and its way by tilting."""
        (begin, rate_before, rotation_before, arms_before, jacobian_before, joints_before) = before
        (end, rate, rotation, arms, jacobian, joints) = now
        mean = 0.5 * (arms + arms_before)
        centre = mean.mean(axis=0)
        difference = rotation @ rotation_before.T
        tilt = np.array((difference[2, 1] - difference[1, 2], difference[0, 2] - difference[2, 0], 0.0)) * 0.5
        ways = -0.5 * ((jacobian + jacobian_before) @ (joints - joints_before)).reshape(4, 3)
        ways -= np.cross(tilt, mean - centre)
        yaw = 0.5 * (rate + rate_before) * (end - begin)
        return end - begin, yaw, ways[:, :2], mean[:, :2], np.cross(tilt, centre)[:2]

    def smooth(self) -> None:
        """Estimate all poses, and write them into those of the cycles."""
        columns = (np.array(column) for column in zip(*self._rows, strict=True))
        times, yaws, ways, arms, tilting, touching, heights, joints = columns
        keys = np.unique(np.append(np.arange(0, len(times), CYCLES), len(times) - 1))
        parts = np.repeat(np.arange(len(keys) - 1), np.diff(keys))
        time, yaw = (np.bincount(parts, each[1:]) for each in (times, yaws))
        ends = np.cumsum(yaws)
        middles = ends[keys[:-1]] + 0.5 * yaw
        turns = ends[1:] - 0.5 * yaws[1:] - middles[parts]
        ways, arms, tilting = (
            np.add.reduceat(_turned(each[1:], turns), keys[:-1])
            for each in (ways, arms, tilting[:, None])
        )  # fmt: skip
        number = np.diff(keys)
        touches = np.logical_and.reduceat(touching[1:], keys[:-1])
        touches[np.count_nonzero(touches, axis=1) < 2] = True
        moved = np.abs(np.diff(joints[keys], axis=0)).max(axis=1)
        rests = moved <= RESTS * time
        rests &= np.append(True, rests[:-1])  # the base sways once joints stop
        ways[rests] = 0.0
        speeds = np.linalg.norm(ways, axis=2) / time[:, None]
        deviations = np.where(rests[:, None], RESTING, SLIP_SHARE * speeds + ENCODERS)
        deviations *= (time / np.sqrt(number))[:, None]
        deviations[~touches] = math.inf
        legs = np.abs(np.diff(joints[keys][:, self.body.legs], axis=0)).max(axis=1) / time
        missed = (SHAKE_RATIO * legs) ** 2 * 2.0 * SHAKING_TIME * time
        arms /= number[:, None, None]
        measured = Intervals(time, yaw, ways, arms, deviations, rolled=moved * WHEEL, missed=missed)
        found = estimate(measured, self._errors)
        found = found._replace(ways=found.ways - tilting[:, 0])
        poses = found.poses()
        at = np.cumsum(times)
        smooth = [np.interp(at, at[keys], column) for column in poses.T]
        for pose, x, y, z, heading in zip(self._poses, smooth[0], smooth[1], heights, smooth[2], strict=True):
            pose[:] = x, y, z, heading


def _turned(vectors: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Turn vectors, shape (T, k, 2), by angles, shape (T,) [rad]."""
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack((cosine * x - sine * y, sine * x + cosine * y), axis=2)

"""Which way wheels are to point: by the motion that is wanted of the base, and by the errors of the vertices."""

import math

import numpy as np

from solfer.components.wheeled_motion.points import PERIOD, ROUNDED, nearest, wrapped
from solfer.components.wheeled_motion.tags import SteeringRecord

SLOW, GAIN = 0.1, 1000.0
"""Below this speed [m/s] errors count by `GAIN` times the speed."""

RESTING = 2e-3
"""Errors of vertices that no wheel steers for, where no motion is wanted [m]."""

RELAXATION = 1e-3
"""Way within which a wheel's direction follows that of its vertex, where errors across it count [m]."""

SMALL, AWAKE = 2.5e-3, 4e-3
"""Errors of a vertex that its wheel rests with, and that let it steer again, where no motion is wanted [m]."""

NEAR = 2e-4
"""Errors count whole where they want a larger way than this in one cycle [m]."""


class Direction:
    """A direction that is low-passed the more, the slower what points there is.

    Args:
        margin: Way in one cycle below which a direction counts less [m].
        period: Period of the control cycle [s].
        half: Half a turn [rad].

    Attributes:
        angle: The direction [rad], of any number of half turns.
        speed: How fast, along it; negative against it [m/s].
    """

    def __init__(self, margin: float, period: float, half: float):
        self.threshold, self._half = margin / period, half
        self.angle = self.speed = 0.0

    def follow(self, angle: float, speed: float) -> None:
        """Turn towards a direction, or the one against it if that is nearer."""
        angle, sign = nearest(angle, self.angle, self._half)
        share = math.tanh(abs(speed) / self.threshold)
        self.angle += share * (angle - self.angle)
        self.speed += share * (sign * speed - self.speed)


class WheelSteering:
    """The direction in which one wheel is to roll.

    Two directions are merged: that of the wheel in the motion that is wanted of the base, about its instantaneous
    centre, and that of its vertex' error. In the original program it is called `reactif`.

    Args:
        tuning: Gains and margins.
        period: Period of the control cycle [s].
        is_rounded: Whether half a turn is the original's, by which a direction creeps that is not wanted any more.
        rests: Whether the wheel stops to steer where no motion is wanted and its vertex is near its reference.

    Attributes:
        motion: Direction by the motion of the base.
        error: Direction by the error of the vertex.
        angle: The result, seen from the heading of the base [rad].
        aim: Where the motion of the base alone leads to [rad].
    """

    def __init__(self, tuning: SteeringRecord, period: float, is_rounded: bool, rests: bool):
        self._rests = rests
        self._tuning, self._period, self._half = tuning, period, ROUNDED if is_rounded else PERIOD
        self.motion = Direction(tuning.damp_icm, period, self._half)
        self.error = Direction(tuning.damp_sp, period, self._half)
        self._threshold = tuning.damp / period * (self.motion.threshold + self.error.threshold)
        self.angle = self.aim = 0.0

    def start(self, angle: float) -> None:
        """Begin with a direction, at rest [rad]."""
        for direction in (self.motion, self.error):
            direction.angle, direction.speed = angle, 0.0
        self.angle = self.aim = angle

    def update(self, wanted: tuple[float, float], error: tuple[float, float], speed: float) -> float:
        """Compute and return the direction of this cycle [rad]; vectors are in the frame of the heading.

        Args:
            wanted: Velocity of the vertex in the motion that is wanted [m/s].
            error: Reference of the vertex minus its place [m].
            speed: Speed of the base since the last cycle [m/s].
        """
        if self._rests and wanted == (0.0, 0.0) and math.hypot(*error) < RESTING:
            return self.angle
        tuning, motion, errors = self._tuning, self.motion, self.error
        if wanted == (0.0, 0.0) and nearest(motion.angle, self.angle)[0] > PERIOD / 4.0:
            motion.angle -= PERIOD - self._half
        self.aim = math.atan2(wanted[1], wanted[0])
        motion.follow(self.aim, math.hypot(*wanted))
        errors.follow(math.atan2(error[1], error[0]), tuning.tracking * math.hypot(*error))
        scale = 1.0
        if speed < SLOW and abs(errors.speed * self._period) < NEAR:
            scale = GAIN * speed + abs(errors.speed)
        trust = min(scale, 1.0)
        if scale < 1.0 and abs(motion.speed) < SLOW:
            trust += GAIN * abs(motion.speed)
        a, b = tuning.icm * motion.speed, tuning.sp * errors.speed
        size = math.sqrt(max(a * a + b * b + 2.0 * a * b * math.cos(motion.angle - errors.angle), 0.0))
        b *= scale
        y = a * math.sin(motion.angle) + b * math.sin(errors.angle)
        x = a * math.cos(motion.angle) + b * math.cos(errors.angle)
        angle, _ = nearest(math.atan2(y, x), self.angle, self._half)
        self.angle += math.tanh(size * trust / self._threshold) * (angle - self.angle)
        return self.angle


class VertexSteering:
    """The direction in which one wheel has to roll so that its vertex stays with its reference.

    It is that of the velocity v + K (1 - d / |e|) e with the velocity v that is wanted of the vertex and its error e,
    where |e| is larger than d = RESTING, and of v where it is not. The slower that is, the slower it is followed:
    within the way RELAXATION. A wheel that is to be still rests where its error is small, until it is larger than
    AWAKE.

    Args:
        gain: Gain K [1/s].
        period: Period of the control cycle [s].

    Attributes:
        angle: The result, seen from the heading of the base [rad].
        aim: Where to, without being low-passed [rad].
    """

    def __init__(self, gain: float, period: float):
        self._gain, self._rate = gain, period / RELAXATION
        self.angle, self.aim, self._is_resting = 0.0, 0.0, False

    def start(self, angle: float) -> None:
        """Begin with a direction [rad]."""
        self.angle = self.aim = angle

    def update(self, wanted: tuple[float, float], error: tuple[float, float], speed: float) -> float:
        """Compute and return the direction of this cycle [rad]; see `WheelSteering.update`."""
        distance = math.hypot(*error)
        self._is_resting = wanted == (0.0, 0.0) and distance < (AWAKE if self._is_resting else SMALL)
        if self._is_resting:
            self.aim = self.angle
            return self.angle
        gain = self._gain * (1.0 - RESTING / distance) if distance > RESTING else 0.0
        x, y = wanted[0] + gain * error[0], wanted[1] + gain * error[1]
        self.aim, _ = nearest(math.atan2(y, x), self.angle)
        self.angle -= math.expm1(-self._rate * math.hypot(x, y)) * (self.aim - self.angle)
        return self.angle


class Steering:
    """The directions in which all wheels are to roll.

    Args:
        tuning: Gains and margins.
        period: Period of the control cycle [s].
        count: Number of wheels.
        is_rounded: See `WheelSteering`.
        rests: See `WheelSteering`.
        across: Gain of errors across the wheels, see `VertexSteering` [1/s]; 0: they steer as in `WheelSteering`.

    Attributes:
        wheels: The wheels.
        angles: Their directions in the world, shape (count,) [rad]; live.
        aims: Where to wheels aim, seen from the heading, shape (count,) [rad]; live.
        speeds: Speeds of the vertices in the motion that is wanted, shape (count,) [m/s]; live.
    """

    def __init__(
        self, tuning: SteeringRecord, period: float, count: int, is_rounded: bool, rests: bool, across: float = 0.0
    ):
        self.wheels: list[WheelSteering | VertexSteering] = [
            VertexSteering(across, period) if across else WheelSteering(tuning, period, is_rounded, rests)
            for _ in range(count)
        ]
        (self.angles, self.aims, self.speeds), self._period = np.zeros((3, count)), period
        self._place, self._heading = (0.0, 0.0), 0.0

    def start(self, place: tuple[float, float], heading: float) -> None:
        """Begin at a place of the base [m] and its heading [rad]."""
        self._place, self._heading = place, heading

    def update(
        self,
        vertices: np.ndarray,
        errors: np.ndarray,
        velocities: np.ndarray,
        place: tuple[float, float],
        heading: float,
        motion: tuple[float, float, float],
    ) -> np.ndarray:
        """Compute and return the directions of this cycle; live.

        Args:
            vertices: Vertices seen from what is tracked of the base, in the frame of the heading, shape (count, 3) [m].
            errors: Their references minus their places there, shape (count, 3) [m].
            velocities: Velocities that are wanted of them there, shape (count, 3) [m/s].
            place: Place of the base in the world [m].
            heading: Its heading [rad].
            motion: Velocity (x, y) in the world [m/s] and rate of the heading [rad/s] that are wanted of the base.
        """
        cos, sin = math.cos(heading), math.sin(heading)
        vx, vy, turn = motion
        wx, wy = cos * vx + sin * vy, cos * vy - sin * vx
        dx, dy = (now - before for now, before in zip(place, self._place, strict=True))
        mx, my = (cos * dx + sin * dy) / self._period, (cos * dy - sin * dx) / self._period
        rate = wrapped(heading - self._heading, 2.0 * math.pi) / self._period
        self._place, self._heading = place, heading
        for index, wheel in enumerate(self.wheels):
            px, py, _ = vertices[index].tolist()
            ex, ey, _ = errors[index].tolist()
            ux, uy, _ = velocities[index].tolist()
            wanted = wx - py * turn + ux, wy + px * turn + uy
            self.speeds[index] = math.hypot(*wanted)
            speed = math.hypot(mx - ey * rate, my + ex * rate)
            self.angles[index] = wheel.update(wanted, (ex, ey), speed) + heading
            self.aims[index] = wheel.aim
        return self.angles

    def let_go(self, index: int, angle: float, heading: float) -> None:
        """Let a wheel that is lifted point where it does, and nothing wait for it; angles in the world [rad]."""
        self.wheels[index].start(angle - heading)
        self.angles[index], self.aims[index], self.speeds[index] = angle, angle - heading, 0.0

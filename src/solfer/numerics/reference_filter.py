"""References that follow targets with limited speed and acceleration, in positions and orientations."""

import math

import numpy as np

from solfer.numerics.blocks import BlockLayout, MemoryBlock
from solfer.numerics.compilation import cached, part
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.rotations import UNIT_TOLERANCE

FURTHEST_TARGET = 1e4
"""Largest coordinate of a target [m]; one beyond it counts as not finite."""

TAKEN, NOT_FINITE, NOT_A_ROTATION = range(3)
"""Outcomes of `ReferenceFilter.aim`."""


REFERENCES = BlockLayout(
    "References",
    size=int,
    limits=(float, "size", 4),
    target=(float, "size", 7),
    value=(float, "size", 7),
    rate=(float, "size", 6),
    stream=(float, "size", 6),  # velocity of the target
    age=(float, "size"),  # time since the last target
    gap=(float, "size"),  # and that between the last two
    ratio=(float, "size"),  # of the limits that a stream is followed with
    is_still=(bool, "size"),
    work=(float, 3, 7),
)
"""What the kernels of a `ReferenceFilter` read and write."""

_references_at = REFERENCES.at


class ReferenceFilter:
    """Positions and orientations that follow targets, never faster and with no more acceleration than they may.

    With the distance e to a target at rest, a reference has the speed min(v, b(|e|), |e| / T) towards it, where
    b(d) = sqrt((a T / 2)^2 + 2 a d) - a T / 2 is the largest speed from which it comes to rest within d in steps of
    the period T. Its velocity changes by a T in a cycle at most. So it arrives without overshoot, but for what one
    period adds. Targets that come one after the other count as one that moves: their mean velocity is added, and the
    target goes on with it between two of them. Such a stream may have gone far away before a start: the reference goes
    to it within a quarter of its limits, and a tenth of them more in each second, until it meets it. Orientations do
    the same with the rotation vector to the target in world axes.

    Args:
        size: Number m of the references.
        period: Period T of the control cycle [s].

    Attributes:
        period: Time by which the next `update` goes on [s]; may be set before each.
        limits: Largest speed [m/s] and acceleration [m/s^2], then those of the rotation [rad/s, rad/s^2], shape (m, 4);
            inf where there is none.
        target: Targets, positions [m], then quaternions (x, y, z, w), shape (m, 7).
        value: The references, shape (m, 7); live.
        rate: Their velocities, linear [m/s], then angular in world axes [rad/s], shape (m, 6); live.
        all_still: Whether all were at their targets, at rest, in the last `update`.
    """

    _FIRST_RATIO = 0.25  # of the limits, for a stream that was not met since the start

    def __init__(self, size: int, period: float):
        self.period = period
        self.limits = np.full((size, 4), np.inf)
        self.target, self.value = np.zeros((2, size, 7))
        self.target[:, 6] = self.value[:, 6] = 1.0
        self.rate = np.zeros((size, 6))
        self._stream = np.zeros((size, 6))
        self._age = np.zeros(size)
        self._gap = np.zeros(size)
        self._ratio = np.full(size, self._FIRST_RATIO)
        self._is_still = np.ones(size, dtype=np.bool_)
        self.all_still = True
        self._work = np.zeros((3, 7))
        self._block = MemoryBlock(
            REFERENCES,
            size=size,
            limits=self.limits,
            target=self.target,
            value=self.value,
            rate=self.rate,
            stream=self._stream,
            age=self._age,
            gap=self._gap,
            ratio=self._ratio,
            is_still=self._is_still,
            work=self._work,
        )
        self._address = self._block.address

    def start(self, index: int, value: np.ndarray) -> None:
        """Put a reference and its target somewhere, at rest; shape (7,)."""
        self.value[index] = self.target[index] = value
        self.rate[index] = 0.0
        self._stream[index] = 0.0
        self._age[index] = np.inf
        self._gap[index] = 0.0
        self._ratio[index] = self._FIRST_RATIO
        self._is_still[index] = True

    def aim(self, index: int, numbers: np.ndarray, first: int, stream: bool = False) -> int:
        """Set the target of a reference. Allocates nothing.

        Args:
            index: Number of the reference.
            numbers: Its numbers from `first` on: a position, a quaternion, or both.
            first: 0 or 3.
            stream: Whether others follow, so that it moves in between.

        Returns:
            TAKEN; NOT_FINITE, or NOT_A_ROTATION where the quaternion has not the length 1: then nothing has changed.
        """
        return _aim(self._address, index, numbers, first, stream)

    def displace(self, index: int, move: PlanarMove) -> None:
        """Move a reference and its target in the world, with what they are doing."""
        for numbers in (self.target[index], self.value[index]):
            move.move(numbers[:3])
            move.rotate_orientation(numbers[3:])
        for rates in (self.rate[index], self._stream[index]):
            move.rotate(rates[:3])
            move.rotate(rates[3:])

    def halt(self, index: int) -> None:
        """Let a reference come to rest as soon as it may: its target becomes the place where it will."""
        target = self.target[index]
        value = self.value[index]
        rate = self.rate[index]
        self._stream[index], self._age[index] = 0.0, np.inf
        _halt(target, value, rate, self.limits[index], self.period, self._work[0])

    def update(self) -> None:
        """Advance all references by `period`. Allocates nothing."""
        self.all_still = _follow(self._address, self.period)

    def is_still(self, index: int) -> bool:
        """Return whether a reference is at its target, at rest."""
        return bool(self._is_still[index])


@part
def _write_rotation(target, value, out):
    """Write the rotation vector that turns one quaternion into another, in world axes, at most pi."""
    ax = target[3]
    ay = target[4]
    az = target[5]
    aw = target[6]
    bx = value[3]
    by = value[4]
    bz = value[5]
    bw = value[6]
    w = aw * bw + ax * bx + ay * by + az * bz
    x = -aw * bx + ax * bw - ay * bz + az * by
    y = -aw * by + ay * bw - az * bx + ax * bz
    z = -aw * bz + az * bw - ax * by + ay * bx
    sign = 1.0 if w >= 0.0 else -1.0
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 * sign if sine < 1e-12 else 2.0 * sign * math.atan2(sine, abs(w)) / sine
    out[0], out[1], out[2] = scale * x, scale * y, scale * z


@part
def _rotate(value, rate, time):
    """Rotate a quaternion by an angular velocity in world axes for some time."""
    x = 0.5 * time * rate[3]
    y = 0.5 * time * rate[4]
    z = 0.5 * time * rate[5]
    half = math.sqrt(x * x + y * y + z * z)
    if half == 0.0:
        return
    scale = math.sin(half) / half
    w = math.cos(half)
    x = scale * x
    y = scale * y
    z = scale * z
    bx = value[3]
    by = value[4]
    bz = value[5]
    bw = value[6]
    value[3] = w * bx + x * bw + y * bz - z * by
    value[4] = w * by + y * bw + z * bx - x * bz
    value[5] = w * bz + z * bw + x * by - y * bx
    value[6] = w * bw - x * bx - y * by - z * bz
    length = math.sqrt(value[3] ** 2 + value[4] ** 2 + value[5] ** 2 + value[6] ** 2)
    for k in range(3, 7):
        value[k] /= length


@part
def _norm(vector):
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@part
def _limited(vector, most):
    """Scale a vector down to a length."""
    length = _norm(vector)
    if length > most:
        for k in range(3):
            vector[k] *= most / length


@part
def _approach(error, stream, rate, speed, acceleration, period, desired):
    """Change a velocity towards a target at the distance `error` that moves with the velocity `stream`."""
    distance = _norm(error)
    fast = min(speed, distance / period)
    if acceleration < math.inf:
        step = 0.5 * acceleration * period
        fast = min(fast, math.sqrt(step * step + 2.0 * acceleration * distance) - step)
    for k in range(3):
        desired[k] = stream[k] + (fast * error[k] / distance if distance > 0.0 else 0.0)
    _limited(desired, speed)
    for k in range(3):
        desired[k] -= rate[k]
    if acceleration < math.inf:
        _limited(desired, acceleration * period)
    for k in range(3):
        rate[k] += desired[k]


def _aim_at(start, index, numbers, first, stream):
    """See `ReferenceFilter.aim`."""
    block = _references_at(start)
    limits = block.limits[index]
    target = block.target[index]
    velocity = block.stream[index]
    last = first + len(numbers)
    for k in range(len(numbers)):
        if not abs(numbers[k]) <= FURTHEST_TARGET:
            return NOT_FINITE
    length = 1.0
    if last == 7:
        length = math.sqrt(numbers[-4] ** 2 + numbers[-3] ** 2 + numbers[-2] ** 2 + numbers[-1] ** 2)
        if abs(length * length - 1.0) > UNIT_TOLERANCE:
            return NOT_A_ROTATION
    new = block.work[0]
    rotation = block.work[1]
    for k in range(7):
        new[k] = target[k] if k < first or k >= last else numbers[k - first] / (length if k > 2 else 1.0)
    _write_rotation(new, target, rotation)
    time = block.age[index]
    # the first of a stream says nothing of its velocity
    is_stream = stream and 0.0 < time < 0.1  # [s]; slower ones are targets on their own
    for k in range(3):
        velocity[k] = (new[k] - target[k]) / time if is_stream else 0.0
        velocity[3 + k] = rotation[k] / time if is_stream else 0.0
    # what is faster than the reference may be is no motion, but another target
    if _norm(velocity[:3]) > limits[0] or _norm(velocity[3:]) > limits[2]:
        velocity[:] = 0.0
    block.gap[index] = time if is_stream else 0.0
    block.age[index] = 0.0 if stream else math.inf
    target[:] = new
    block.is_still[index] = False
    return TAKEN


def _follow_all(start, period):
    """See `ReferenceFilter.update`; return whether all are still."""
    block = _references_at(start)
    limits = block.limits
    stream = block.stream
    age = block.age
    value = block.value
    rate = block.rate
    error = block.work[0]
    desired = block.work[1]
    aim = block.work[2]
    all_still = True
    for i in range(block.size):
        if age[i] > 2.0 * block.gap[i]:  # a stream goes on until no target has come for two of its periods
            stream[i] = 0.0
        aim[:] = block.target[i]
        if stream[i].any():
            for k in range(3):
                aim[k] += stream[i, k] * age[i]
            _rotate(aim, stream[i], age[i])
        for k in range(3):
            error[k] = aim[k] - value[i, k]
        distance = _norm(error)
        ratio = block.ratio[i] if age[i] < math.inf else 1.0
        speed = ratio * limits[i, 0]
        angular_speed = ratio * limits[i, 2]
        _approach(error, stream[i, :3], rate[i, :3], speed, ratio * limits[i, 1], period, desired)
        _write_rotation(aim, value[i], error)
        _approach(error, stream[i, 3:], rate[i, 3:], angular_speed, ratio * limits[i, 3], period, desired)
        if ratio < 1.0:
            has_met = distance <= speed * period and _norm(error) <= angular_speed * period
            block.ratio[i] = 1.0 if has_met else min(ratio + 0.1 * period, 1.0)
        for k in range(3):
            value[i, k] += period * rate[i, k]
        _rotate(value[i], rate[i], period)
        age[i] += period
        is_still = _norm(rate[i, :3]) + _norm(rate[i, 3:]) < 1e-9 and distance + _norm(error) < 1e-9
        block.is_still[i] = is_still
        all_still = all_still and is_still
    return all_still


def _halt_at(target, value, rate, limits, period, displacement):
    """See `ReferenceFilter.halt`."""
    for first in (0, 3):
        speed = _norm(rate[first : first + 3])
        acceleration = limits[2 * first // 3 + 1]
        time = 0.5 * (speed / acceleration - period) if acceleration < math.inf else 0.0
        for k in range(first, first + 3):
            displacement[k] = rate[k] * max(time, 0.0)
    target[:] = value
    for k in range(3):
        target[k] += displacement[k]
    _rotate(target, displacement, 1.0)


_ROW = "float64[::1]"

_aim = cached(f"int64(int64, int64, {_ROW}, int64, boolean)", _aim_at)
_follow = cached("boolean(int64, float64)", _follow_all)
_halt = cached(f"void({_ROW}, {_ROW}, {_ROW}, {_ROW}, float64, {_ROW})", _halt_at)

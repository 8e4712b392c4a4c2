"""Compares two recordings of the same motion."""

from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline

from solfer.errors import RecordingError
from solfer.numerics.rotations import whole_revolutions
from solfer.recording.model import Recording
from solfer_tools.review.fit import BLOCK, DELAY, GAIN, LONGEST_DELAY, NEUTRAL, OFFSET, Law, fit
from solfer_tools.review.motion import JointMotion, Samples, measured_joints, sampled, shift_of
from solfer_tools.review.verdict import SHAPE_TOLERANCE, Difference, JointVerdict, excess, findings_of, thresholds

MIN_MOTION_RANGE = 0.02
"""Smallest range of a joint that moves [rad, m]."""

CERTAIN_SIGMAS = 8.0
"""Standard deviations of the noise that the largest of thousands of samples does not reach."""


@dataclass(frozen=True)
class Comparison:
    """Result of `compare`.

    Attributes:
        verdicts: What was found out about each joint, those of the first recording before those that it lacks.
        shift: Time of the second recording's clock minus that of the first [s].
        times: When both were compared, after the first recording's beginning, shape (T,) [s].
        first: Smoothed positions of the joints in both, shape (joints, T) [rad, m].
        second: The same of the second recording.
        joints: Names of the rows of `first` and `second`.
    """

    verdicts: tuple[JointVerdict, ...]
    shift: float
    times: np.ndarray = field(repr=False)
    first: np.ndarray = field(repr=False)
    second: np.ndarray = field(repr=False)
    joints: tuple[str, ...] = ()

    @property
    def different(self) -> tuple[JointVerdict, ...]:
        """The joints that differ: missing ones, then in the order of time."""
        found = (each for each in self.verdicts if each.differences)
        return tuple(sorted(found, key=lambda each: -1.0 if np.isnan(each.since) else each.since))

    @property
    def hardly_moving(self) -> tuple[str, ...]:
        """Joints that hardly move: only an offset of theirs would have been found."""
        return tuple(each.joint for each in self.verdicts if not each.moves and not each.differences)


def compare(
    first: Recording, second: Recording, names: tuple[str, str] = ("A", "B"), plugins: Sequence[str] = ()
) -> Comparison:
    """Compare what two recordings of the same motion measured of the joints.

    Args:
        first: What counts as right.
        second: What is evaluated.
        names: Their files, for errors and texts.
        plugins: Plugins whose feedbacks count; empty: all.

    Raises:
        UnknownName: There is no such plugin.
        RecordingError: Joints were not recorded, do not move, or not long enough at the same time.
    """
    one, two = (
        measured_joints(recording, name, plugins) for recording, name in zip((first, second), names, strict=True)
    )
    joints = [joint for joint in one if joint in two]
    if not joints:
        raise RecordingError(
            "no joint is in both recordings", where=" ".join(names), expected="recordings of the same robot"
        )
    pair = _Pair([one[joint] for joint in joints], [two[joint] for joint in joints], names)
    verdicts = pair.verdicts(joints)
    missing = [*_missing(one, two, names[1]), *_missing(two, one, names[0])]
    return Comparison(
        (*verdicts, *missing), pair.shift, pair.elapsed, first=pair.first, second=pair.second, joints=tuple(joints)
    )


def _missing(there: Iterable[str], lacking: Container[str], name: str) -> Iterator[JointVerdict]:
    absent = (joint for joint in there if joint not in lacking)
    return (JointVerdict(joint, (Difference.MISSING,), f"missing in {name}") for joint in absent)


class _Pair:
    """Joints of two recordings on one clock; see `Comparison`."""

    def __init__(self, one: Sequence[JointMotion], two: Sequence[JointMotion], names: tuple[str, str]):
        periods = [np.median([motion.period for motion in motions]) for motions in (one, two)]
        step = float(np.clip(max(periods), 0.001, 0.025))  # [s]
        a = sampled(one, step)
        b = sampled(two, step)
        self._names = names
        self._turns = np.array([motion.turn for motion in one])[:, None]
        for samples, name in ((a, names[0]), (b, names[1])):
            self._check_long(samples.positions.shape[1] * step, name)
        self.noise, self._density = np.hypot(a.noise, b.noise), np.hypot(a.density, b.density)
        self._look(a.positions, b.positions)
        if not self._both.size:
            raise RecordingError(
                "no joint moves in both recordings, so that they cannot be aligned", where=" ".join(names),
                expected=f"a motion of {MIN_MOTION_RANGE:g} rad or more",
            )  # fmt: skip
        self._curves = [CubicSpline(a.times, row) for row in a.positions]
        self._others = CubicSpline(b.times, b.positions, axis=1)
        self._align(a, b)
        self._look(self.first, self.second)  # only now it is known which parts belong together

    def _look(self, first: np.ndarray, second: np.ndarray) -> None:
        """Find the joints that move in both, and those that move in one of them alone: clearly, not just a bit more."""
        # twenty standard deviations of what smoothing leaves of the noise
        least = np.maximum(MIN_MOTION_RANGE, 20.0 * self.noise)
        one = np.ptp(first, axis=1)
        two = np.ptp(second, axis=1)
        self._both = np.flatnonzero((one > least) & (two > least))
        self._still = (one > least) & (two < np.minimum(least, 0.5 * one))
        self._alone = (two > least) & (one < np.minimum(least, 0.5 * two))

    def _check_long(self, duration: float, where: str) -> None:
        least = 8 * BLOCK
        if duration < least:
            raise RecordingError(
                f"{max(0.0, duration):.2f} s are too short to be compared", where=where,
                expected=f"{least:g} s or more in which all joints were measured",
            )  # fmt: skip

    def _align(self, a: Samples, b: Samples) -> None:
        """Find the shift, coarsely by correlation, then as the median of the delays of all joints that move."""
        self.shift = shift_of(a, b, self._both)
        self._overlap(a, b)
        laws = [self._fit(joint, joint, (GAIN, OFFSET, DELAY)) for joint in self._both.tolist()]
        self.shift += float(np.median([law.values[DELAY] for law in laws]))
        self._overlap(a, b)

    def _overlap(self, a: Samples, b: Samples) -> None:
        """Take both at the same times."""
        start = max(a.times[0], b.times[0] - self.shift) + LONGEST_DELAY
        end = min(a.times[-1], b.times[-1] - self.shift) - LONGEST_DELAY
        self._check_long(end - start, " ".join(self._names))
        self._times = start + a.step * np.arange(int((end - start) / a.step) + 1)
        self.elapsed = self._times - a.start
        self.first = np.array([curve(self._times) for curve in self._curves])
        self.second = self._others(self._times + self.shift)
        # either may have begun on another revolution
        self.second -= whole_revolutions(np.median(self.second - self.first, axis=1, keepdims=True), self._turns)
        self.apart = self.second - self.first

    def _fit(self, joint: int, other: int, free: tuple[int, ...]) -> Law:
        """Fit `joint` of the second recording to `other` of the first."""
        noise = float(self.noise[joint])
        density = float(self._density[joint])
        return fit(self._curves[other], self._times, self.second[joint], free=free, noise=noise, density=density)

    def _law(self, joint: int) -> tuple[Law, Law]:
        """Fit the law with as few parameters as are needed, and with all that can be evaluated."""
        free: tuple[int, ...] = (OFFSET,)
        if joint in self._both:
            # a delay that all joints have in common is that of the clocks: it takes three to tell which one is late
            free = (GAIN, OFFSET, DELAY) if len(self._both) >= 3 else (GAIN, OFFSET)
        whole = law = self._fit(joint, joint, free)
        if excess(law, free).max() < 0.5 and _size(self.apart[joint]) < 2.0 * self.noise[joint]:
            free = ()
            law = Law(NEUTRAL, law.limits, self.apart[joint])
        while free and (ratios := excess(law, free)).min() < 1.0:
            free = tuple(each for each in free if each != free[int(np.argmin(ratios))])
            law = self._fit(joint, joint, free)
        return law, whole

    def verdicts(self, joints: Sequence[str]) -> list[JointVerdict]:
        """Compare each joint alone, then look for swapped ones among those that differ."""
        found = [self._verdict(index, joint) for index, joint in enumerate(joints)]
        different = [index for index, verdict in enumerate(found) if verdict.differences]
        for place, joint in enumerate(different):
            for other in different[place + 1 :]:
                if self._resembles(joint, other) and self._resembles(other, joint):
                    for one, two in ((joint, other), (other, joint)):
                        found[one] = self._made(
                            one, joints[one], (Difference.SWAPPED,), text=f"swapped with {joints[two]}"
                        )
        return found

    def _resembles(self, joint: int, other: int) -> bool:
        """Return whether a joint of the second recording does what another one of the first does."""
        left = _size(self.second[joint] - self.first[other])
        # a swap explains the difference where it leaves a quarter of it
        return left < max(0.25 * _size(self.apart[joint]), 2.0 * self.noise[joint])

    def _verdict(self, index: int, joint: str) -> JointVerdict:
        if self._still[index]:
            text = f"does not move (range {np.ptp(self.first[index]):.3f} in {self._names[0]})"
            return self._made(index, joint, (Difference.NOT_MOVED,), text=text)
        if self._alone[index]:
            text = f"moves alone (range {np.ptp(self.second[index]):.3f})"
            return self._made(index, joint, (Difference.MOVED_ALONE,), text=text)
        law, whole = self._law(index)
        kinds, text = findings_of(law, thresholds(law))
        limit = max(SHAPE_TOLERANCE, CERTAIN_SIGMAS * self.noise[index])
        left = float(np.abs(law.residual).max())
        explained = bool(kinds) and _size(law.residual) <= 0.5 * _size(self.apart[index])
        if left > limit and not explained:
            kinds = (Difference.OTHER,)
            text = f"by up to {left:.4f}, which no gain, offset or delay explains"
        return self._made(index, joint, kinds, text=text, law=law, whole=whole)

    def _made(
        self, index: int, joint: str, kinds: tuple[Difference, ...], text: str,
        law: Law | None = None, *, whole: Law | None = None,
    ) -> JointVerdict:  # fmt: skip
        apart = np.abs(self.apart[index])
        largest = float(apart.max())
        since = float("nan")
        if kinds:
            begin = max(min(CERTAIN_SIGMAS * self.noise[index], 0.5 * largest), 0.1 * largest)
            since = float(self.elapsed[np.argmax(apart >= begin)])
        return JointVerdict(
            joint, kinds, text, since=since, largest=largest,
            law=None if law is None else law.values,
            limits=None if whole is None else thresholds(whole),
            moves=index in self._both,
        )  # fmt: skip


def _size(values: np.ndarray) -> float:
    """Return the root mean square of numbers."""
    return float(np.sqrt(np.mean(values**2)))

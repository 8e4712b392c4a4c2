"""The measured motion of the joints in a recording."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import correlate, correlation_lags, savgol_coeffs

from solfer.errors import RecordingError, UnknownName
from solfer.recording.model import JOINTS_KIND, Channel, Recording

POSITION = "/position"
"""End of the names of channels of positions."""


@dataclass(frozen=True)
class JointMotion:
    """One joint over time.

    Attributes:
        times: When it was measured, ascending, shape (T,) [s].
        positions: Its position, shape (T,) [rad, m].
        turn: A revolution, after which it is where it was [rad]; 0: none.
    """

    times: np.ndarray
    positions: np.ndarray
    turn: float = 0.0

    @property
    def cleaned(self) -> np.ndarray:
        """Positions in which single outliers yielded to the median of their neighbours (Hampel), shape (T,)."""
        middle = median_filter(self.positions, 5, mode="nearest")
        wrong = np.abs(self.positions - middle) > 8.0 * self.noise
        return np.where(wrong, middle, self.positions)

    @property
    def period(self) -> float:
        """Median time between two measurements [s]."""
        return float(np.median(np.diff(self.times)))

    @property
    def noise(self) -> float:
        """Standard deviation of the measurement, from its third differences, which a motion hardly has [rad, m]."""
        third = np.abs(np.diff(self.positions, 3))
        # a simulation without noise still rounds and interpolates
        return max(1e-5, float(1.4826 * np.median(third) / np.sqrt(20.0)))


def measured_joints(recording: Recording, where: str, plugins: Sequence[str] = ()) -> dict[str, JointMotion]:
    """Return what the feedbacks of a recording measured of each joint; of two, the first one with that joint counts.

    A row holds what was received last. Where the age of the message was recorded, each measurement counts once, at
    the time of its arrival.

    Args:
        recording: The recording.
        where: Its file, for errors.
        plugins: Plugins whose feedbacks count; empty: all.

    Raises:
        UnknownName: There is no such plugin.
        RecordingError: No feedback has positions of joints, or too few rows.
    """
    for name in plugins:
        if name not in recording.plugins:
            raise UnknownName("plugin", name, recording.plugins, where=where)
    found: dict[str, JointMotion] = {}
    for channel in recording.channels.values():
        plugin, feedback, _ = channel.name.partition("/feedback/")
        if (
            feedback
            and channel.kind == JOINTS_KIND
            and channel.name.endswith(POSITION)
            and plugin in (plugins or (plugin,))
        ):
            for joint, motion in _motions(recording, channel).items():
                found.setdefault(joint, motion)
    if not found:
        raise RecordingError(
            "no positions of joints were recorded", where=where, expected="<plugin>/feedback/<pipe>/position"
        )
    return found


def _motions(recording: Recording, channel: Channel) -> dict[str, JointMotion]:
    """Return the motion of each joint of a channel; one without measurements is left out."""
    times = channel.times
    age = recording.channels.get(channel.name.removesuffix(POSITION) + "/age")
    if age is not None and np.array_equal(age.times, times):
        times = times - age.values[:, 0]
    keep = np.isfinite(times)
    keep[keep] = np.diff(times[keep], prepend=-np.inf) > 1e-6
    motions = {}
    continuous = continuous_joints(recording)
    for column, joint in enumerate(channel.columns):
        valid = keep & np.isfinite(channel.values[:, column])
        if np.count_nonzero(valid) > 8:
            positions = channel.values[valid, column]
            turn = math.tau if joint in continuous else 0.0
            # one that was recorded within a revolution goes on counting
            motions[joint] = JointMotion(times[valid], np.unwrap(positions) if turn else positions, turn)
    return motions


def continuous_joints(recording: Recording) -> set[str]:
    """Return the continuous joints of the URDFs that a recording holds.

    Raises:
        RecordingError: One of them is damaged.
    """
    names: set[str] = set()
    for attachment, content in recording.attachments.items():
        if not attachment.endswith(".urdf"):
            continue
        try:
            robot = ElementTree.fromstring(content)
        except ElementTree.ParseError as error:
            raise RecordingError(f"not XML: {error}", where=attachment, expected="the URDF of the robot") from None
        names.update(joint.get("name", "") for joint in robot.iterfind("joint[@type='continuous']"))
    return names


@dataclass(frozen=True)
class Samples:
    """Joints at equal distances in time, smoothed.

    Attributes:
        start: Time of the first sample [s].
        step: Time between two samples [s].
        positions: Shape (joints, T) [rad, m].
        noise: Standard deviation of each joint that the smoothing leaves, shape (joints,).
        density: Standard deviation of a mean of n samples times the root of n, for large n, shape (joints,).
    """

    start: float
    step: float
    positions: np.ndarray
    noise: np.ndarray
    density: np.ndarray

    @property
    def times(self) -> np.ndarray:
        """Time of each sample, shape (T,) [s]."""
        return self.start + self.step * np.arange(self.positions.shape[1])


def sampled(motions: Sequence[JointMotion], step: float) -> Samples:
    """Sample and smooth joints over the time in which all of them were measured (Savitzky and Golay 1964)."""
    start = max(each.times[0] for each in motions)
    end = min(each.times[-1] for each in motions)
    times = start + step * np.arange(max(0, int((end - start) / step) + 1))
    window = 0.05  # short against the motion of a robot, long against its sampling [s]
    half = max(2, round(0.5 * window / step))
    weights = savgol_coeffs(2 * half + 1, 3)
    raw = np.array([np.interp(times, each.times, each.cleaned) for each in motions])
    padded = np.pad(raw, ((0, 0), (half, half)), mode="edge")
    smooth = np.array([np.convolve(row, weights, "valid") for row in padded])
    # samples that lie closer than the measurements share their noise
    density = np.array([each.noise * np.sqrt(max(1.0, each.period / step)) for each in motions])
    noise = np.minimum([each.noise for each in motions], np.linalg.norm(weights) * density)
    return Samples(start, step, smooth, noise=noise, density=density)


def shift_of(first: Samples, second: Samples, moving: np.ndarray) -> float:
    """Find the shift at which the speeds of all joints fit best [s].

    What `first` does at the time t, `second` does at t + shift. The absolute values of the joints' correlations are
    added, so that a wrong sign or two swapped joints do not matter.

    Args:
        first: Joints of one recording.
        second: The same joints of the other, with the same step.
        moving: Indices of the joints that move in both.
    """
    total = np.zeros(first.positions.shape[1] + second.positions.shape[1] - 3)
    for joint in moving:
        a = np.diff(first.positions[joint])
        b = np.diff(second.positions[joint])
        total += np.abs(correlate(b, a, method="fft")) / (np.linalg.norm(a) * np.linalg.norm(b))
    lags = correlation_lags(second.positions.shape[1] - 1, first.positions.shape[1] - 1)
    return float(second.start - first.start + first.step * lags[np.argmax(total)])

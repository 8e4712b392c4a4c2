"""The time by which two recordings are shifted: their clocks began at different times."""

import numpy as np
from scipy.signal import correlate, correlation_lags

from solfer.recording.comparison.motion import Samples


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

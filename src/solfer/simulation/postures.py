"""Joint positions of named states."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from solfer.errors import ModelError, UnknownName

ROUNDING = 1e-9


class Postures:
    """Positions of all joints in each named state.

    Args:
        states: Joint positions by name, for each state. Joints that a state does not name are as in `start`.
        start: Name of the state that completes the others and is meant by None; without one, all joints are at zero,
            or at the limit that is next to it.
        joints: Names of the joints.
        lower, upper: Their limits, shape (len(joints),) [rad, m].
    """

    def __init__(self, states: Mapping[str, Mapping[str, float]], start: str | None, joints: Sequence[str],
                 lower: np.ndarray, upper: np.ndarray):
        self._states, self._start, self._joints, self._lower, self._upper = states, start, tuple(joints), lower, upper

    def of(self, state: str | None = None) -> np.ndarray:
        """Positions of the joints in a state (None: the start), shape (len(joints),) [rad, m].

        Raises:
            UnknownName: There is no such state.
            ModelError: The state has a joint beyond its limits.
        """
        posture = np.clip(0.0, self._lower, self._upper)
        place = {joint: index for index, joint in enumerate(self._joints)}
        for name in dict.fromkeys(name for name in (self._start, state) if name is not None):
            if name not in self._states:
                raise UnknownName("state", name, self._states)
            for joint, value in self._states[name].items():
                if joint in place:
                    posture[place[joint]] = value
        for joint, value, low, high in zip(self._joints, posture, self._lower, self._upper, strict=True):
            if not low - ROUNDING <= value <= high + ROUNDING or not math.isfinite(value):
                raise ModelError(f"state '{state or self._start}' has joint '{joint}' at {value:g}",
                                 expected=f"from {low:g} to {high:g} [rad]")
        return posture

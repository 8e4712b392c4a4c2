"""Joint positions of named states."""

import math
from collections.abc import Mapping

import numpy as np

from solfer.errors import ModelError, UnknownName
from solfer.model.followers import Followers
from solfer.model.kinematics import Kinematics
from solfer.model.neutral_posture import neutral_posture


class Postures:
    """Positions of all joints in each named state.

    Args:
        states: Joint positions by name, for each state. Joints that a state does not name are as in `start`, and those
            that `start` does not name as in the robot's neutral posture.
        start: Name of the state that None stands for; without one, None is the neutral posture.
        kinematics: Model of the robot.
    """

    def __init__(self, states: Mapping[str, Mapping[str, float]], start: str | None, kinematics: Kinematics):
        self._start = start
        self._states = states
        joints = slice(0 if kinematics.base is None else 6, None)
        self._joints = kinematics.dofs[joints]
        self._lower = kinematics.lower_position[joints]
        self._upper = kinematics.upper_position[joints]
        self._neutral = neutral_posture(kinematics)[joints]
        self._followers = Followers(self._joints, kinematics.description.mimics)

    def positions_of(self, state: str | None = None) -> np.ndarray:
        """Look up the positions of the joints in a state (None: the start), shape (len(joints),) [rad, m].

        Raises:
            UnknownName: There is no such state.
            ModelError: The state has a joint beyond its limits.
        """
        posture = self._neutral.copy()
        place = {joint: index for index, joint in enumerate(self._joints)}
        for name in dict.fromkeys(name for name in (self._start, state) if name is not None):
            if name not in self._states:
                raise UnknownName("state", name, self._states)
            for joint, value in self._states[name].items():
                if joint in place:
                    posture[place[joint]] = value
        self._followers.follow(posture)
        rounding = 1e-9  # [rad, m]
        for joint, value, low, high in zip(self._joints, posture, self._lower, self._upper, strict=True):
            if not low - rounding <= value <= high + rounding or not math.isfinite(value):
                raise ModelError(
                    f"state '{state or self._start}' has joint '{joint}' at {value:g}",
                    expected=f"from {low:g} to {high:g} [rad]",
                )
        return posture

"""How far a task is from its reference, and whether it still comes nearer."""

import math

import numpy as np

from solfer.components.following.quantity import PoseNumbers

CHECK_PERIOD = 0.02
"""Time between two checks whether a task still comes nearer to its reference [s]."""

CREEP_RATIO = 1e-3
"""Ratio to the rate that its gain requests below which it does not: the rest would take a thousand times as long."""

CREEP_GROWTH = math.exp(CHECK_PERIOD / 0.2)
"""Growth of that ratio from one check to the next, by the factor e in 0.2 s that the reference has been at rest: what
an arm gains by swinging on gets less and less, and it comes to rest in any case."""


class Residual:
    """Distance and angle of a task's point from its reference.

    Args:
        error: Error of the task; live.
        numbers: Numbers of the reference.
        tolerances: Those of a task that has arrived [m, rad], shape (2,); live.
        values: Where they are written, as of the last cycle [m, rad], shape (2,).

    Attributes:
        values: See above.
    """

    def __init__(self, error: np.ndarray, numbers: PoseNumbers, tolerances: np.ndarray, values: np.ndarray):
        self.values = values
        self._place = error[numbers.place]
        self._turn = error[numbers.turn]
        self._tolerances = tolerances

    def measure(self) -> None:
        """Measure them."""
        self.values[0] = math.hypot(*self._place.tolist())
        self.values[1] = math.hypot(*self._turn.tolist())

    def is_beyond(self) -> bool:
        """Return whether one of them is beyond its tolerance."""
        return bool((self.values > self._tolerances).any())

    def __str__(self) -> str:
        far = [f"{self.values[0]:.4g} m"] if len(self._place) else []
        return " and ".join(far + ([f"{self.values[1]:.4g} rad"] if len(self._turn) else []))


class TaskProgress:
    """Whether a task comes nearer to a reference that is at rest, or has come to rest away from it.

    Args:
        gain: Gain of the task [1/s].

    Attributes:
        gain: See above.
        stays: Whether the distance does not change any more.
        is_unreachable: Whether the task has come to rest away from its reference.
    """

    def __init__(self, gain: float):
        self.gain = gain
        self.stays = False
        self.is_unreachable = False
        self._is_reported = False
        self._creep = CREEP_RATIO
        self._last = math.inf
        self._looks = 0

    def look(self, distance: float) -> None:
        """Look whether a distance from the reference has become less; called every CHECK_PERIOD."""
        is_creeping = abs(distance - self._last) < self._creep * self.gain * distance * CHECK_PERIOD
        self._creep = min(self._creep * CREEP_GROWTH, 1.0)
        self._looks = self._looks + 1 if is_creeping else 0
        self._last = distance
        self.stays = self._looks >= 5

    def come_to_rest(self, is_beyond: bool) -> bool:
        """Note whether the task has come to rest beyond its tolerances; return whether to report it, once."""
        self.is_unreachable = is_beyond
        is_new = is_beyond and not self._is_reported
        self._is_reported = self._is_reported or is_beyond
        return is_new

    def look_again(self) -> None:
        """Look from the beginning."""
        self._last = math.inf
        self._looks = 0
        self.stays = False

    def restart(self) -> None:
        """Begin with a reference that moves."""
        self.look_again()
        self.is_unreachable = False
        self._creep = CREEP_RATIO

    def forget(self) -> None:
        """Begin with another reference."""
        self.restart()
        self._is_reported = False

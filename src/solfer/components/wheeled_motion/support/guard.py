"""Where motions come to rest: the margin of the support polygon, wheels that lean, legs that do not reach farther."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.components.wheeled_motion.support.polygon import SupportPolygon
from solfer.components.wheeled_motion.tags import CAMBER, CASTER, VERTICES

LEAN = 0.5
"""How far camber and caster may be away from what is wanted of them [rad]: steering fails where wheels lean more."""

AWAY = 0.02
"""How far vertices may be away from their references along the ways of their wheels [m]: legs do not reach farther."""

SWIFT, STRAIGHT = 0.5, 25.0
"""Speed of a leg's joint [rad/s], and by the speed of the motion [rad/m], beyond which a leg is nearly straight."""

RETRY = 1.0
"""Time after which a motion that is held tries to go on [s]."""

ASIDE = 0.5
"""Cosine of the angle to the way that is held, below which another way is free."""

WORSE = 1.1
"""Share of what held one way that holds another one, too."""


class MotionGuard:
    """Holds motions that lead where the robot does not get on: references rest, and go on in other directions.

    Args:
        polygon: The support polygon.
        wheels: Names of the wheels.
        rows: Rows of each task of the stack; the first ones of camber, caster and vertices are one a wheel.
        legs: DoFs of the legs but for wheels and their steering, by their names.

    Attributes:
        polygon: The support polygon.
        why: What holds the motion; empty: nothing.
    """

    def __init__(self, polygon: SupportPolygon, wheels: Sequence[str], rows: dict[str, slice], legs: dict[str, int]):
        self.polygon, self.why = polygon, ""
        kinds = ((CAMBER, "camber", "rad", LEAN), (CASTER, "caster", "rad", LEAN), (VERTICES, "vertex", "m", AWAY))
        self._rows = [
            (f"{what} of '{wheel}'", unit, most, rows[task].start + index)
            for task, what, unit, most in kinds
            if task in rows
            for index, wheel in enumerate(wheels)
        ]
        self._names, self._legs = tuple(legs), np.array(list(legs.values()), dtype=int)
        self._way, self._worst, self._age = np.zeros(max(each.stop for each in rows.values())), 0.0, 0.0

    def start(self) -> None:
        """Hold nothing."""
        self.why, self._worst, self._age = "", 0.0, 0.0

    def update(self, errors: np.ndarray, forward: np.ndarray, pace: float, velocity: np.ndarray, period: float) -> bool:
        """Return whether the motion is held.

        Args:
            errors: What is wanted less what is, of all rows of the stack, shape (rows,).
            forward: Rates that are wanted of them, shape (rows,).
            pace: Share of these that goes on.
            velocity: Joint velocities, shape (n,).
            period: Time since the last call [s].
        """
        size = math.sqrt(float(forward.dot(forward)))
        if size == 0.0:
            return False
        other = float(forward.dot(self._way)) < ASIDE * size
        why, amount = self._reason(errors, pace * size, velocity)
        if why and amount > (WORSE * self._worst if self.why and other else 0.0):
            self.why, self._worst, self._age = why, amount, 0.0
            np.divide(forward, size, out=self._way)
            return True
        if not self.why:
            return False
        self._age += period
        if self._age > RETRY and not why:
            self.start()
        return bool(self.why) and not other

    def _reason(self, errors: np.ndarray, speed: float, velocity: np.ndarray) -> tuple[str, float]:
        """Return what is beyond its bound most, and by which share of the bound; an empty text: nothing is."""
        why, worst = "", 1.0
        if self.polygon.is_held:
            why = f"the centre of mass is {self.polygon.margin:.3f} m inside the support polygon"
        for what, unit, most, row in self._rows:
            error = abs(float(errors[row]))
            if error > worst * most:
                why, worst = f"{what} is {error:.2f} {unit} off", error / most
        if why or not len(self._legs):
            return why, worst
        swift = np.abs(velocity[self._legs])
        index = int(swift.argmax())
        if swift[index] > max(SWIFT, STRAIGHT * speed):
            return f"joint '{self._names[index]}' is near a singularity", 1.0
        return "", 0.0

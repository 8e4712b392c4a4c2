"""Where motions come to rest: the margin of the support polygon, wheels that tilt, legs that do not reach farther."""

import logging
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from solfer.components.wheeled_motion.support.kernel import (
    AMOUNT,
    FIRST_ROW,
    GUARD,
    MARGIN,
    NOTHING,
    POLYGON,
    REASON,
    STATE_SIZE,
    hold_back,
)
from solfer.components.wheeled_motion.support.polygon import SupportPolygon
from solfer.components.wheeled_motion.tags import BASE, CAMBER, CASTER, VERTICES
from solfer.numerics.blocks import MemoryBlock
from solfer.throttle import Throttle

log = logging.getLogger(__name__)


class TaskRates(NamedTuple):
    """Rows of the tasks, live, each of shape (rows,) but for the Jacobian.

    Attributes:
        rows: Rows of each task, by its name.
        jacobian: Jacobian of all rows, shape (rows, n).
        rates: Rates of all rows: those by which errors go away and, at the pace, desired ones.
        error: Desired less present values.
        away: Rates by which errors of base and vertices go away.
        forward: Desired rates of base and vertices, whole.
    """

    rows: dict[str, slice]
    jacobian: np.ndarray
    rates: np.ndarray
    error: np.ndarray
    away: np.ndarray
    forward: np.ndarray


class MotionGuard:
    """Holds motions that lead where the robot does not get on: references rest, and go on in other directions.

    Args:
        polygon: The support polygon.
        lifted: Which wheels are lifted; live, shape (m,).
        wheels: Names of the wheels.
        rates: Rows of the tasks; the first ones of camber, caster and vertices are one a wheel.
        legs: DoFs of the legs but for wheels and their steering, by their names.
        turning: DoFs that steer the wheels, shape (m,).
        velocity: Joint velocities, which it shortens; live, shape (n,).

    Attributes:
        polygon: The support polygon.
        is_held: Whether the motion is held.
    """

    def __init__(
        self,
        polygon: SupportPolygon,
        lifted: np.ndarray,
        wheels: Sequence[str],
        rates: TaskRates,
        legs: dict[str, int],
        *,
        turning: np.ndarray,
        velocity: np.ndarray,
    ):
        rows = rates.rows
        self.polygon = polygon
        self.is_held = False
        self._throttle = Throttle(log)
        self._names = tuple(legs)
        kinds = (
            # steering fails where wheels tilt more, and legs do not reach farther along the ways of their wheels
            (CAMBER, "camber", "rad", 0.5),
            (CASTER, "caster", "rad", 0.5),
            (VERTICES, "vertex", "m", 0.02),
        )
        watched = [
            (f"{what} of '{wheel}'", unit, most, rows[task].start + index)
            for task, what, unit, most in kinds
            if task in rows
            for index, wheel in enumerate(wheels)
        ]
        self._watched = [(what, unit) for what, unit, _, _ in watched]
        self._state = np.zeros(STATE_SIZE)
        self._block = MemoryBlock(
            GUARD,
            count=len(lifted),
            dofs=len(velocity),
            rows=len(rates.error),
            points=polygon.points,
            lifted=lifted,
            order=polygon.order,
            edges=polygon.edges,
            of_base=rows[BASE].start if BASE in rows else -1,
            of_vertices=rows[VERTICES].start if VERTICES in rows else -1,
            jacobian=rates.jacobian,
            rates=rates.rates,
            error=rates.error,
            away=rates.away,
            forward=rates.forward,
            held=np.zeros(len(rates.error)),
            velocity=velocity,
            state=self._state,
            watched_count=len(watched),
            watched=np.array([row for _, _, _, row in watched], dtype=np.int64),
            bounds=np.array([most for _, _, most, _ in watched]),
            leg_count=len(legs),
            legs=np.array(list(legs.values()), dtype=np.int64),
            turning_count=len(turning),
            turning=turning,
            required_margin=polygon.required_margin,
        )
        self._address = self._block.address

    def set_required_margin(self, margin: float) -> None:
        """Set the margin that motions leave [m]."""
        self.polygon.required_margin = margin
        self._block.record["required_margin"] = margin

    @property
    def margin(self) -> float:
        """Distance of the centre of mass from the nearest edge as of the last cycle [m]; negative: outside."""
        return float(self._state[MARGIN])

    @property
    def why(self) -> str:
        """What holds the motion; empty: nothing."""
        why = int(self._state[REASON])
        amount = self._state[AMOUNT]
        if why == NOTHING:
            return ""
        if why == POLYGON:
            return f"the centre of mass is {amount:.3f} m inside the support polygon"
        index = why - FIRST_ROW
        if index < len(self._watched):
            what, unit = self._watched[index]
            return f"{what} is {amount:.2f} {unit} off"
        return f"joint '{self._names[index - len(self._watched)]}' is near a singularity"

    def warn(self, name: str, other: str) -> None:
        """Log what holds a component: `other` where the guard does not."""
        self._throttle.warning("held", "%s holds where it is: %s", name, self.why or other)

    def start(self) -> None:
        """Hold nothing."""
        self._state[:] = 0.0
        self.is_held = False

    def update(self, pace: float, is_bound: bool, passed: float) -> bool:
        """Shorten joint velocities that would use up the margin; return whether the motion is held.

        Args:
            pace: Ratio of the desired rates that goes on.
            is_bound: Whether a joint is at its bound.
            passed: Time since the cycle before [s].
        """
        self.is_held = hold_back(self._address, pace, is_bound, passed)
        return self.is_held

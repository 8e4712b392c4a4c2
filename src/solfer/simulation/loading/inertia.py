"""Inertias that no body has, made physical."""

import logging
import math

import numpy as np

MARGIN = 1e-5
"""Smallest second moment of mass over their sum: Bullet, in single precision, drops inertias without it."""

logger = logging.getLogger(__name__)
_FROM_MOMENTS = np.ones((3, 3)) - np.eye(3)
"""Maps second moments of mass of a body, none of them negative, to its principal inertias."""


class Inertias:
    """Checks the inertias of a robot's links, and repairs those that no body has.

    No principal inertia is negative, and none is larger than the sum of the other two. Source: P. Wensing, S. Kim,
    J.-J. Slotine, "Linear Matrix Inequalities for Physically Consistent Inertial Parameter Identification", 2018.

    Args:
        where: The URDF, for errors.
    """

    def __init__(self, where: str):
        self._where = where
        self._repaired: list[str] = []

    def physical(self, link: str, mass: float, inertia: np.ndarray) -> np.ndarray:
        """Return the inertia, or the nearest one that a body has, shape (3, 3) each [kg m^2]; `warn` logs repairs.

        A mass without inertia becomes a ball of steel.

        Args:
            link: Its link.
            mass: Its mass [kg].
            inertia: Inertia about the centre of mass, symmetric.
        """
        principal, axes = np.linalg.eigh(inertia)
        if abs(principal).max() < mass * 1e-6**2:  # a radius of gyration of less than 1e-6 m stands for no inertia
            ball = _ball(mass)
            self._note(link, principal, ball)
            return np.diag(ball)
        moments = np.linalg.inv(_FROM_MOMENTS) @ principal
        if moments.min() >= MARGIN * moments.sum() > 0.0:
            return inertia
        nearest = _nearest(principal)
        small, middle, large = principal
        rounding = 1e-6  # over the largest principal inertia: it is worth no warning
        if small < -rounding * large or large > (small + middle) * (1.0 + rounding):
            change = np.linalg.norm(nearest - principal) / np.linalg.norm(principal)
            self._note(link, principal, nearest, change=f" (by {100.0 * change:.2g} %)")
        return (axes * nearest) @ axes.T

    def warn(self) -> None:
        """Log what was repaired."""
        if self._repaired:
            more = f"; and {len(self._repaired) - 4} more" if len(self._repaired) > 4 else ""
            listed = "; ".join(self._repaired[:4])
            logger.warning(
                "%s: principal inertias that no body has are replaced by the nearest: %s%s", self._where, listed, more
            )

    def _note(self, link: str, before: np.ndarray, after: np.ndarray, change: str = "") -> None:
        self._repaired.append(f"link '{link}': {_listed(before)} -> {_listed(after)} kg m^2{change}")


def _nearest(principal: np.ndarray) -> np.ndarray:
    """Compute the nearest principal inertias of a body, whose second moments all have the margin, shape (3,)."""
    from scipy.optimize import nnls  # heavy, and needed by few robots

    lower = MARGIN * abs(principal).sum()
    return _FROM_MOMENTS @ (nnls(_FROM_MOMENTS, principal - _FROM_MOMENTS @ np.full(3, lower))[0] + lower)


def _ball(mass: float) -> np.ndarray:
    """Compute the principal inertias of a ball of steel, 2/5 m r^2, shape (3,) [kg m^2]."""
    density = 7800.0  # [kg/m^3]
    radius = (3.0 * mass / (4.0 * math.pi * density)) ** (1.0 / 3.0)
    return np.full(3, 0.4 * mass * radius**2)


def _listed(values: np.ndarray) -> str:
    return ", ".join(f"{value:.6g}" for value in values)

"""Inertias that no body has, made physical where they nearly are."""

import logging
import math

import numpy as np

from solfer.errors import SimulationError

INERTIA_ROUNDING = 1e-6
"""Share of the largest principal inertia that counts as rounding: it is worth no warning."""

INERTIA_MARGIN = 1e-5
"""Least second moment of mass, as a share of their sum: Bullet, in single precision, drops inertias without it."""

INERTIA_SMALLEST_SIZE = 1e-6
"""Radius of gyration below which an inertia stands for none at all [m]."""

INERTIA_DENSITY = 7800.0
"""Density of steel, of which a link without inertia is made [kg/m^3]."""

REPAIRED = 0.1
"""Largest repair, as a share of the inertia (norms of Frobenius): more is no inaccuracy but another body."""

INERTIA_SHOWN_COUNT = 4
"""Number of links that a warning names."""

logger = logging.getLogger(__name__)
_MOMENTS = np.ones((3, 3)) - np.eye(3)  # principal inertias of a body from its second moments of mass, none negative
_INERTIA_SECOND = np.linalg.inv(_MOMENTS)


class Inertias:
    """Checks the inertias of a robot's links, and repairs those that miss what every body has by a little.

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

        Raises:
            SimulationError: It is far from the inertia of any body.
        """
        principal, axes = np.linalg.eigh(inertia)
        if abs(principal).max() < mass * INERTIA_SMALLEST_SIZE**2:
            ball = _ball(mass)
            self._note(link, principal, ball)
            return np.diag(ball)
        moments = _INERTIA_SECOND @ principal
        if moments.min() >= INERTIA_MARGIN * moments.sum() > 0.0:
            return inertia
        nearest = _nearest(principal)
        small, middle, large = principal
        if small < -INERTIA_ROUNDING * large or large > (small + middle) * (1.0 + INERTIA_ROUNDING):
            self._repair(link, principal, nearest)
        return (axes * nearest) @ axes.T

    def warn(self) -> None:
        """Log what was repaired."""
        if self._repaired:
            more = (
                f"; and {len(self._repaired) - INERTIA_SHOWN_COUNT} more"
                if len(self._repaired) > INERTIA_SHOWN_COUNT
                else ""
            )
            listed = "; ".join(self._repaired[:INERTIA_SHOWN_COUNT])
            logger.warning(
                "%s: principal inertias that no body has are replaced by the nearest: %s%s", self._where, listed, more
            )

    def _repair(self, link: str, principal: np.ndarray, nearest: np.ndarray) -> None:
        """Note a repair.

        Raises:
            SimulationError: It is no repair, but another body.
        """
        share = np.linalg.norm(nearest - principal) / np.linalg.norm(principal)
        if share > REPAIRED:
            raise SimulationError(
                f"no body has the principal inertia {_listed(principal)} kg m^2",
                where=f"{self._where}: link '{link}'",
                expected="none negative, none larger than the sum of the others",
            )
        self._note(link, principal, nearest, share=f" (by {100.0 * share:.2g} %)")

    def _note(self, link: str, before: np.ndarray, after: np.ndarray, share: str = "") -> None:
        self._repaired.append(f"link '{link}': {_listed(before)} -> {_listed(after)} kg m^2{share}")


def _nearest(principal: np.ndarray) -> np.ndarray:
    """Compute the nearest principal inertias of a body, whose second moments all have the margin, shape (3,)."""
    from scipy.optimize import nnls  # heavy, and needed by few robots

    least = INERTIA_MARGIN * abs(principal).sum()
    return _MOMENTS @ (nnls(_MOMENTS, principal - _MOMENTS @ np.full(3, least))[0] + least)


def _ball(mass: float) -> np.ndarray:
    """Compute the principal inertias of a ball of steel, 2/5 m r^2, shape (3,) [kg m^2]."""
    radius = (3.0 * mass / (4.0 * math.pi * INERTIA_DENSITY)) ** (1.0 / 3.0)
    return np.full(3, 0.4 * mass * radius**2)


def _listed(values: np.ndarray) -> str:
    return ", ".join(f"{value:.6g}" for value in values)

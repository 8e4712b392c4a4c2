"""Base class of all dynamic models: three elements that are computed when they are used and stale."""

from collections.abc import Callable, Hashable

import numpy as np

from solfer.dynamics.update_manager import Calls, UpdateManager

BIAS = "bias"
"""Name of the bias force as an element of a dynamic model."""

INERTIA = "inertia"
"""The same of the inertia matrix."""

INERTIA_INVERSE = "inertia_inverse"
"""The same of its inverse."""


class Elements:
    """Bias force, inertia and its inverse of a model; a subclass computes them into arrays of its own.

    Each is computed at most once for a state: what is subscribed by `update`, the rest at its first use. Arrays are
    live: they hold until the state changes and must not be written to.

    Args:
        stamp: Returns for the name of an element what returns the stamp of its inputs, see `UpdateManager.add`.
        bias: Writes the bias force.
        inertia: Writes the inertia.
        inverse: Writes its inverse.

    Attributes:
        manager: Counts what is subscribed and what was computed.
    """

    _bias: np.ndarray
    _inertia: np.ndarray
    _inertia_inverse: np.ndarray

    def __init__(
        self,
        stamp: Callable[[str], Callable[[], Hashable]],
        bias: Callable[[], None],
        inertia: Callable[[], None],
        inverse: Callable[[], None],
    ):
        self.manager = UpdateManager()
        self.manager.add(BIAS, bias, stamp(BIAS))
        self.manager.add(INERTIA, inertia, stamp(INERTIA))
        self.manager.add(INERTIA_INVERSE, inverse, stamp(INERTIA_INVERSE))

    def subscribe(self, calls: Calls) -> None:
        """See `UpdateManager.subscribe`."""
        self.manager.subscribe(calls)

    def unsubscribe(self, calls: Calls) -> None:
        """See `UpdateManager.unsubscribe`."""
        self.manager.unsubscribe(calls)

    @property
    def bias(self) -> np.ndarray:
        """Bias force: Coriolis, centrifugal and gravity [Nm, N]."""
        self.manager.use(BIAS)
        return self._bias

    @property
    def inertia(self) -> np.ndarray:
        """Inertia matrix [kg, kg m, kg m^2]."""
        self.manager.use(INERTIA)
        return self._inertia

    @property
    def inertia_inverse(self) -> np.ndarray:
        """Inverse of the inertia matrix."""
        self.manager.use(INERTIA_INVERSE)
        return self._inertia_inverse

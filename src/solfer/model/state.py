"""Joint-space data of a Robot: one array an interface, one number a DoF (section 1.1.2 of the paper)."""

from collections.abc import Sequence
from numbers import Integral
from typing import Any

import numpy as np

from solfer.errors import ModelError, SizeMismatch, UnknownName
from solfer.model.history import History

DEFAULTS = ("position", "velocity", "acceleration", "torque")
"""Interfaces of every State."""

POSE_COVARIANCE = "pose_covariance"
"""Interface of who estimates a floating base: 36 numbers, row by row, of position and rotations about the axes of the
world [m, rad]."""

TWIST_COVARIANCE = "twist_covariance"
"""The same of linear and angular velocity in the axes of the base's link [m/s, rad/s]."""


class State:
    """Position, velocity, acceleration and torque of all DoFs, and any interface that is added.

    Arrays are live: they show every later change, and may be written to. Each interface has a version, which
    moves when `write` or an assignment really changes it, or by `touch`.

    Args:
        dofs: Names of the DoFs.

    Attributes:
        dofs: Names of the DoFs.
        position: [rad, m], shape (n,).
        velocity: [rad/s, m/s], shape (n,).
        acceleration: [rad/s^2, m/s^2], shape (n,).
        torque: [Nm, N], shape (n,).
        defaults: These four one below the other, shape (4, n); the same memory. To assign one of them copies into it.
        versions: How often each interface changed, by its name; to be read only.
        histories: What pipes hand over message by message, in the order of the pipes; those with `history` alone.
    """

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray

    def __init__(self, dofs: Sequence[str]):
        self.dofs = tuple(dofs)
        self.defaults = np.zeros((len(DEFAULTS), self.size))
        self._arrays = dict(zip(DEFAULTS, self.defaults, strict=True))
        self.versions = dict.fromkeys(self._arrays, 0)
        self._added: set[str] = set(self._arrays)
        self.histories: list[History] = []
        vars(self).update(self._arrays)

    def window(self) -> "State":
        """Return the same State for another user: both have one memory, with all that is ever added, and one version.

        Only `add` distinguishes them: each user may add an interface of the same name and size, and both get one array.
        """
        other = State.__new__(State)
        vars(other).update(vars(self), _added=set(DEFAULTS))
        return other

    @property
    def size(self) -> int:
        """Number of DoFs."""
        return len(self.dofs)

    @property
    def interfaces(self) -> tuple[str, ...]:
        """Names of the interfaces, the default ones first."""
        return tuple(self._arrays)

    def add(self, name: str, size: int | None = None) -> np.ndarray:
        """Add an interface of `size` numbers (default: one a DoF), all zero, and return its live array.

        Raises:
            ModelError: There is an interface of that name.
            SizeMismatch: The size is not a whole number from zero on, or that of another user's interface of that name.
        """
        if name in self._added:
            raise ModelError(f"the state has an interface '{name}' already", expected="a new name")
        if size is not None and (not isinstance(size, Integral) or size < 0):
            raise SizeMismatch(f"an interface '{name}' of {size!r} numbers", expected="a whole number from zero on")
        size = self.size if size is None else size
        if name not in self._arrays:
            self._arrays[name] = np.zeros(size)
            self.versions[name] = 0
        elif len(self._arrays[name]) != size:
            raise SizeMismatch(
                f"an interface '{name}' of {size} numbers, which another component has with {len(self._arrays[name])}",
                expected="one size for all that have this State in common, or another name",
            )
        self._added.add(name)
        return self._arrays[name]

    def write(self, name: str, values: np.ndarray, indices: np.ndarray | None = None) -> bool:
        """Copy `values` into an interface, or into its entries `indices`; the version moves only if data changed.

        Returns:
            Whether data changed.

        Raises:
            UnknownName: There is no such interface.
            SizeMismatch: `values` and its destination differ in size.
        """
        array = self[name]
        values = np.asarray(values, dtype=float)
        part = array if indices is None else array[indices]
        if values.shape != part.shape:
            raise SizeMismatch(f"'{name}' has numbers of shape {part.shape}, got shape {values.shape}")
        if part.tobytes() == values.tobytes():
            return False
        array[... if indices is None else indices] = values
        self.versions[name] += 1
        return True

    def touch(self, *names: str) -> None:
        """Move the versions of interfaces whose arrays were written directly."""
        versions = self.versions
        for name in names:
            if name not in versions:
                raise UnknownName("interface", name, versions)
            versions[name] += 1

    def version(self, name: str) -> int:
        """Return how often the interface changed."""
        if name not in self.versions:
            raise UnknownName("interface", name, self._arrays)
        return self.versions[name]

    def __setattr__(self, name: str, value: Any) -> None:
        if name in DEFAULTS:
            self.write(name, value)
        else:
            super().__setattr__(name, value)

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._arrays:
            raise UnknownName("interface", name, self._arrays)
        return self._arrays[name]

    def __setitem__(self, name: str, values: np.ndarray) -> None:
        self.write(name, values)

    def __contains__(self, name: object) -> bool:
        return name in self._arrays

    def __repr__(self) -> str:
        return f"State({self.size} DoFs: {', '.join(self._arrays)})"

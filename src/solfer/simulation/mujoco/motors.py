"""Motors that hold speeds, and the friction of joints, which holds zero."""

from collections.abc import Sequence
from typing import Any

import numpy as np

RIGID = (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""`solimp` of motors, gears and limits: as rigid as MuJoCo allows."""


class Motors:
    """MuJoCo's constraints of dry friction, whose reference is moved from rest to a speed.

    Args:
        model: The model.
        data: Its state.

    Attributes:
        turn: Whether a motor holds another speed than zero.
    """

    def __init__(self, model: Any, data: Any):
        self._data = data
        self._effort = np.zeros(model.nv)
        self._speed = np.zeros(model.nv)
        self.turn = self._is_old = False
        self._loss = model.dof_frictionloss
        self._find()

    @property
    def effort(self) -> np.ndarray:
        """What the motors did in the newest step, shape (nv,) [Nm, N]."""
        if self._is_old:
            self._effort[self._held] = self._data.efc_force[self._data.ne + self._rows]
            self._is_old = False
        return self._effort

    def limit(self, dofs: np.ndarray, efforts: Sequence[float]) -> None:
        """Limit the efforts."""
        if not np.array_equal(self._loss[dofs], efforts):
            self._effort = self.effort  # of the motors that there were
            self._loss[dofs] = efforts
            self._find()

    def hold(self, dofs: np.ndarray, speeds: np.ndarray) -> None:
        """Hold speeds, see `JointGroup.hold_speeds`."""
        self._speed[dofs] = speeds
        self.turn = bool(np.count_nonzero(self._speed)) and bool(len(self._held))

    def move(self) -> None:
        """Move the references of a step's constraints, after these are made; at rest they are where MuJoCo has them."""
        data = self._data
        rows = data.ne + self._rows  # they follow the equalities
        data.efc_aref[rows] += data.efc_KBIP[rows, 1] * self._speed[self._held]

    def age(self) -> None:
        """Note that a step was made."""
        self._is_old = bool(len(self._held))

    def _find(self) -> None:
        """Find the DoFs that have such a constraint, in whose order MuJoCo makes them."""
        self._held = np.flatnonzero(self._loss > 0.0)
        self._rows = np.arange(len(self._held))

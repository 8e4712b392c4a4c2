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

    Attributes:
        effort: What the motors did in the newest step, shape (nv,) [Nm, N].
    """

    def __init__(self, model: Any):
        self.effort = np.zeros(model.nv)
        self._speed = np.zeros(model.nv)
        self._turns = False
        self._loss = model.dof_frictionloss
        self._find()

    def hold(self, dofs: np.ndarray, speeds: np.ndarray, efforts: Sequence[float]) -> None:
        """Hold speeds, see `JointGroup.hold_speeds`."""
        if not np.array_equal(self._loss[dofs], efforts):
            self._loss[dofs] = efforts
            self._find()
        self._speed[dofs] = speeds
        self._turns = bool(self._speed.any())

    def move(self, data: Any) -> None:
        """Move the references of a step's constraints, after these are made."""
        if self._turns and len(self._held):  # at rest they are where MuJoCo has made them
            rows = data.ne + self._rows  # they follow the equalities
            data.efc_aref[rows] += data.efc_KBIP[rows, 1] * self._speed[self._held]

    def read(self, data: Any) -> None:
        """Read what the motors did, after a step."""
        if len(self._held):
            self.effort[self._held] = data.efc_force[data.ne + self._rows]

    def _find(self) -> None:
        """Find the DoFs that have such a constraint, in whose order MuJoCo makes them."""
        self._held = np.flatnonzero(self._loss > 0.0)
        self._rows = np.arange(len(self._held))

"""Dynamics of a kinematic tree, with the arrays that the kernels work on."""

import numpy as np
from scipy.linalg import lapack

from solfer.dynamics import kernel
from solfer.errors import ModelError
from solfer.model.view import RobotView

DENSE_CALL, DENSE_SHARE = 3500, 0.125
"""When LAPACK inverts faster: beyond this many products of the recursion over the tree, plus this share of n^3.
Measured by `benchmark/growth.py`: it wins from some 30 joints in a row on, and loses where limbs branch off a base."""


class Recursion:
    """Bias force, inertia matrix and its inverse at the present kinematics of a robot; nothing is allocated.

    `place` comes first after each change of positions, `compute_inertia` before `compute_inverse`.

    Args:
        robot: The robot.

    Attributes:
        bias: Bias force, shape (n,) [Nm, N].
        inertia: Inertia matrix, shape (n, n) [kg, kg m, kg m^2].
        inertia_inverse: Its inverse, shape (n, n).
    """

    def __init__(self, robot: RobotView):
        self._robot = robot
        self._tree = robot.kinematics.tree
        self._gravity = np.array(robot.kinematics.gravity)
        size = robot.kinematics.size
        self.bias, self.inertia, self.inertia_inverse = np.zeros(size), *np.zeros((2, size, size))
        # entries that are always zero are not written: what is folded is not the array that the recursion writes
        self._followers = self._tree.followers
        self._folds = bool(self._tree.followers)
        self._unfolded = np.zeros((size, size)) if self._folds else self.inertia
        self._diagonal = self._unfolded.reshape(-1)[:: size + 1]
        self._has_rotors = bool(self._tree.armature.any())
        self._parents = self._tree.parents[1:] - 1
        self._last = np.arange(size)
        for body in range(size - 1, -1, -1):
            if self._parents[body] >= 0:
                self._last[self._parents[body]] = max(self._last[self._parents[body]], self._last[body])
        self._line = np.arange(-1, size - 1)
        self._ends = np.full(size, size - 1)
        self._spatial, self._composite = np.zeros((2, size, 10))
        self._motion = np.zeros((size, 12))
        self._force = np.zeros((size, 6))
        products = np.sum((self._last - np.arange(size) + 1) ** 2)
        self._dense = products > DENSE_CALL + DENSE_SHARE * size**3
        # LAPACK's own order, so that it works in place
        self._factor = np.zeros((size, size), order="F" if self._dense else "C")
        self._roots = np.zeros(size)
        self._inverse_diagonal = self.inertia_inverse.reshape(-1)[:: size + 1]

    def place(self) -> None:
        """Compute the inertias of the bodies in world axes."""
        tree = self._tree
        kernel.place(tree.placements, tree.masses, tree.levers, tree.inertias, self._spatial)

    def compute_bias(self) -> None:
        """Write `bias`."""
        kernel.bias(
            self._tree.jacobian,
            self._tree.velocity,
            self._parents,
            self._spatial,
            self._gravity,
            self._motion,
            self._force,
            self.bias,
        )
        if self._folds:
            self._followers.fold(self.bias)

    def compute_inertia(self) -> None:
        """Write `inertia`."""
        kernel.inertia(self._tree.jacobian, self._parents, self._spatial, self._composite, self._unfolded)
        if self._has_rotors:
            self._diagonal += self._tree.armature
        if self._folds:
            self.inertia[:] = self._unfolded
            self._followers.fold_inertia(self.inertia)

    def compute_inverse(self) -> None:
        """Write `inertia_inverse`.

        Raises:
            ModelError: The inertia matrix is not positive definite.
        """
        failed = self._invert_dense() if self._dense else self._invert_tree()
        if failed >= 0:
            dof = self._robot.kinematics.dofs[failed]
            raise ModelError(
                f"nothing has inertia against a motion of '{dof}' of '{self._robot.name}'",
                expected="links with masses behind every joint",
            )

    def _invert_tree(self) -> int:
        """Invert by the factors of the tree; return the DoF at which that fails, or -1."""
        parents = self._parents
        last = self._last
        if self._folds:  # a leader moves what other branches carry, too: no entry is surely zero
            parents = self._line
            last = self._ends
        return kernel.inverse(self.inertia, parents, last, self._factor, self._roots, self.inertia_inverse)

    def _invert_dense(self) -> int:
        """Invert by LAPACK, for long chains, whose factors have no zeros; return as `_invert_tree`."""
        np.copyto(self._factor, self.inertia)
        _, failed = lapack.dpotrf(self._factor, lower=1, clean=1, overwrite_a=1)
        if failed:
            return failed - 1
        lapack.dpotri(self._factor, lower=1, overwrite_c=1)
        np.add(self._factor, self._factor.T, out=self.inertia_inverse)
        self._inverse_diagonal *= 0.5
        return -1

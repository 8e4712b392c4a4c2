"""Dynamics of a kinematic tree, with the arrays that the kernels work on."""

from functools import partial

import numpy as np
from scipy.linalg import lapack

from solfer.dynamics import kernel
from solfer.errors import ModelError
from solfer.model.view import RobotView
from solfer.numerics.blocks import MemoryBlock


class _Branches:
    """Which bodies the kernels go over.

    Args:
        parents: Parent of each body, -1: the world, shape (n,).
        is_folded: Whether a leader moves what other branches carry, too: then no entry is surely zero.

    Attributes:
        parents: See above.
        factor_parents: The same for factors of the inertia matrix.
        factor_last: Last body that each carries, for factors, shape (n,).
        products: Products of numbers that the recursion needs for an inverse.
    """

    def __init__(self, parents: np.ndarray, is_folded: bool):
        size = len(parents)
        last = np.arange(size)
        for body in range(size - 1, -1, -1):
            if parents[body] >= 0:
                last[parents[body]] = max(last[parents[body]], last[body])
        self.parents = parents
        self.factor_parents = np.arange(-1, size - 1) if is_folded else parents
        self.factor_last = np.full(size, size - 1) if is_folded else last
        self.products = np.sum((last - np.arange(size) + 1) ** 2)


class Recursion:
    """Bias force, inertia matrix and its inverse at the present kinematics of a robot; nothing is allocated.

    Bodies have to be placed first after each change of positions, and the inertia comes before `compute_inverse`.

    Args:
        robot: The robot.

    Attributes:
        bias: Bias force, shape (n,) [Nm, N].
        inertia: Inertia matrix, shape (n, n) [kg, kg m, kg m^2].
        inertia_inverse: Its inverse, shape (n, n).
        compute: compute(parts) computes a sum of `kernel.PLACE`, `WITH_BIAS` and `WITH_INERTIA`, and writes the last
            two.
    """

    def __init__(self, robot: RobotView):
        self._robot = robot
        self._tree = robot.kinematics.tree
        size = robot.kinematics.size
        self.bias = np.zeros(size)
        self.inertia, self.inertia_inverse = np.zeros((2, size, size))
        # entries that are always zero are not written: what is folded is not the array that the recursion writes
        self._folds = bool(self._tree.followers)
        self._unfolded = np.zeros((size, size)) if self._folds else self.inertia
        self._branches = _Branches(self._tree.parents[1:] - 1, self._folds)
        self._block = self._make_block(size)
        self.compute = self._fold if self._folds else partial(kernel.compute, self._block.address)
        # when LAPACK inverts faster, measured by `benchmark/growth.py`: from some 30 joints in a row on, but not where
        # limbs branch off a base
        self._dense = self._branches.products > 3500 + 0.125 * size**3
        # LAPACK's own order, so that it works in place
        self._factor = np.zeros((size, size), order="F" if self._dense else "C")
        self._roots = np.zeros(size)

    def _make_block(self, size: int) -> MemoryBlock:
        tree = self._tree
        return MemoryBlock(
            kernel.BODIES,
            size=size,
            joints=tree.jacobian,
            placements=tree.placements,
            velocity=tree.velocity,
            masses=tree.masses,
            levers=tree.levers,
            inertias=tree.inertias,
            armature=tree.armature,
            parents=self._branches.parents,
            gravity=np.array(self._robot.kinematics.gravity),
            spatial=np.zeros((size, 10)),
            composite=np.zeros((size, 10)),
            motion=np.zeros((size, 12)),
            force=np.zeros((size, 6)),
            bias=self.bias,
            inertia=self._unfolded,
        )

    def _fold(self, parts: int) -> None:
        """Compute `parts`, and give what belongs to followers to their leaders."""
        kernel.compute(self._block.address, parts)
        if parts & kernel.WITH_BIAS:
            self._tree.followers.fold(self.bias)
        if parts & kernel.WITH_INERTIA:
            self.inertia[:] = self._unfolded
            self._tree.followers.fold_inertia(self.inertia)

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
        branches = self._branches
        parents = branches.factor_parents
        last = branches.factor_last
        return kernel.inverse(self.inertia, parents, last, self._factor, self._roots, self.inertia_inverse)

    def _invert_dense(self) -> int:
        """Invert by LAPACK, for long chains, whose factors have no zeros; return as `_invert_tree`."""
        np.copyto(self._factor, self.inertia)
        _, failed = lapack.dpotrf(self._factor, lower=1, clean=1, overwrite_a=1)
        if failed:
            return failed - 1
        lapack.dpotri(self._factor, lower=1, overwrite_c=1)
        np.add(self._factor, self._factor.T, out=self.inertia_inverse)
        self.inertia_inverse.reshape(-1)[:: len(self.bias) + 1] *= 0.5
        return -1

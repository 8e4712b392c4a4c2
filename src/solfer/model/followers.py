"""Joints that follow others: `<mimic>` of a URDF."""

from collections.abc import Sequence

import numpy as np

from solfer.model.urdf.elements import Mimic


class Followers:
    """DoFs that follow others: q_f = r q_l + o, so that both are one degree of freedom, that of the leader l.

    A follower keeps its place in all arrays. Where numbers of all DoFs are folded, the leader gets those of its
    followers, whose own columns become zero.

    Args:
        dofs: Names of the robot's DoFs.
        mimics: The joints that follow, each with its leader, which does not follow itself.

    Attributes:
        names: Names of the followers.
        dofs: Their DoFs, shape (k,).
        leaders: DoFs that they follow, shape (k,).
        ratios: r, shape (k,).
        offsets: o, shape (k,) [rad, m].
    """

    def __init__(self, dofs: Sequence[str], mimics: dict[str, Mimic]):
        self.names = tuple(name for name in dofs if name in mimics)
        found = [mimics[name] for name in self.names]
        self.dofs = np.array([dofs.index(name) for name in self.names], dtype=np.int64)
        self.leaders = np.array([dofs.index(one.joint) for one in found], dtype=np.int64)
        self.ratios = np.array([one.multiplier for one in found])
        self.offsets = np.array([one.offset for one in found])

    def __bool__(self) -> bool:
        return bool(self.names)

    def follow(self, position: np.ndarray, *rates: np.ndarray) -> None:
        """Write the followers' positions, and their velocities or accelerations, shape (n,) each, by their leaders'."""
        position[self.dofs] = self.ratios * position[self.leaders] + self.offsets
        for rate in rates:
            rate[self.dofs] = self.ratios * rate[self.leaders]

    def fold(self, values: np.ndarray) -> np.ndarray:
        """Fold numbers of all DoFs in place, shape (..., n), and return them: Jacobians, or forces of DoFs."""
        for dof, leader, ratio in zip(self.dofs, self.leaders, self.ratios, strict=True):
            values[..., leader] += ratio * values[..., dof]
            values[..., dof] = 0.0
        return values

    def fold_inertia(self, inertia: np.ndarray) -> np.ndarray:
        """Fold an inertia matrix in place, shape (n, n), and return it.

        A follower gets a unit inertia of its own, which nothing moves, so that the matrix stays positive definite.
        """
        self.fold(self.fold(inertia).T)
        inertia[self.dofs, self.dofs] = 1.0
        return inertia

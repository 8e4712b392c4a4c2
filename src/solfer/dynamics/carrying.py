"""Torques that carry a robot on its contacts, by a QR decomposition of their Jacobian."""

import numpy as np
from scipy.linalg import lapack

from solfer.dynamics.carrying_kernel import CARRYING, bear, carry
from solfer.dynamics.dynamic_model import DynamicModel
from solfer.dynamics.elements import BIAS
from solfer.errors import SizeMismatch
from solfer.numerics.blocks import MemoryBlock
from solfer.numerics.solvers.null_space import RANK_TOLERANCE

WEAK = 1e-3
"""How well contacts hold a motion of the DoFs without torque, from 0 to 1; below this they carry less and less of it.
A load along the way of wheels that are nearly parallel, or whose axles nearly meet, needs forces across them that are
1 / sqrt(WEAK) times as large: more than friction bears."""


class CarryingTorques:
    """The smallest torques with which contacts that do not move bear the bias force of a robot.

    Without acceleration h = tau + J^T f, with the bias force h, the contacts' Jacobian J and forces f along its rows.
    The DoFs `free` have no torque: those of a floating base, joints without a drive. Where contacts bear more than the
    robot's weight needs, many forces do; chosen are those with the least |tau|.

    J^T = Q R, with r orthonormal columns Q that span the rows of J, and B the rows of Q that belong to `free`:

        tau = h - Q x,   x next to Q^T h of all that satisfy B x = h_free

    This is tau = (A without its columns `free`)^+ A h, with the null space A of J (A J^T = 0), for which no matrix of
    the size of the robot is needed. The eigenvalues s of B B^T, from 0 to 1, show how well the contacts hold `free`;
    below WEAK, s / WEAK^2 counts instead of 1 / s. See Mistry, Buchli, Schaal (2010), "Inverse dynamics control of
    floating base systems using orthogonal decomposition". Where no torques carry the robot, as on contacts in one line,
    they carry what they can.

    Args:
        model: Dynamics of the robot.
        free: Indices of the DoFs without torque, shape (m,).

    Attributes:
        torque: Torques of the newest `update`, shape (n,) [Nm, N].
        rank: Number of independent constraints r.
        carried: Number of the DoFs `free` that the contacts hold: m, where the robot is carried whole.
    """

    def __init__(self, model: DynamicModel, free: np.ndarray):
        size = model.robot.kinematics.size
        count = len(free)
        self.model = model
        self._bias = model.bias
        self.torque = np.zeros(size)
        self.rank = self.carried = 0
        self._held = np.zeros((count, count))
        self._load, self._parts, self._ratios = np.zeros((3, count))
        self._well = np.zeros(count, dtype=bool)
        self._block = MemoryBlock(
            CARRYING,
            dofs=size,
            free_count=count,
            free=np.array(free, dtype=np.int64),
            span=np.zeros((size, size)),
            along=np.zeros(size),
            held=self._held,
            load=self._load,
            torque=self.torque,
            squares=np.zeros((2, size)),
            factor=np.zeros((count, count)),
        )

    def update(self, jacobian: np.ndarray) -> np.ndarray:
        """Compute `torque` for the present state, and return it.

        Args:
            jacobian: That of the contacts, shape (k, n), k <= n; rows of zeros do not count.

        Raises:
            SizeMismatch: `jacobian` has another shape.
        """
        self.model.manager.use(BIAS)
        bias = self._bias
        size = len(self.torque)
        if jacobian.ndim != 2 or jacobian.shape[1] != size or len(jacobian) > size:
            raise SizeMismatch(f"a matrix of shape {jacobian.shape}, expected (k, {size}), k <= {size}")
        self.rank, is_held = carry(self._block.address, jacobian, bias, RANK_TOLERANCE, WEAK)
        self.carried = len(self._load) if self.rank else 0
        if not is_held:
            self._bear_weakly()
            bear(self._block.address, bias, self.rank)
        return self.torque

    def _bear_weakly(self) -> None:
        """Solve for `load` by the eigenvectors of what holds the DoFs `free`; those that little holds fade out."""
        # a symmetric matrix is its transpose, so LAPACK can work on its memory as it is
        eigenvalues, vectors, _ = lapack.dsyev(self._held.T, overwrite_a=1)
        np.dot(self._load, vectors, out=self._parts)
        np.greater(eigenvalues, WEAK, out=self._well)
        self.carried = int(np.count_nonzero(self._well))
        np.divide(eigenvalues, WEAK**2, out=self._ratios)
        np.divide(1.0, eigenvalues, out=self._ratios, where=self._well)
        self._parts *= self._ratios
        np.dot(vectors, self._parts, out=self._load)

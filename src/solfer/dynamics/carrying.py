"""Torques that carry a robot on its contacts, by a QR decomposition of their Jacobian."""

import numpy as np

from solfer.dynamics.carrying_kernel import CARRYING, carry
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
        self._block = MemoryBlock(
            CARRYING,
            dofs=size,
            free_count=count,
            free=np.array(free, dtype=np.int64),
            span=np.zeros((size, size)),
            along=np.zeros(size),
            held=np.zeros((count, count)),
            load=np.zeros(count),
            torque=self.torque,
            squares=np.zeros((2, size)),
            factor=np.zeros((count, count)),
            rows=np.zeros((count, count)),
            part=np.zeros(count),
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
        self.rank, self.carried = carry(self._block.address, jacobian, bias, RANK_TOLERANCE, WEAK)
        return self.torque

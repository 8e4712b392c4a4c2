"""Torques that carry a robot on its contacts, by a QR decomposition of their Jacobian."""

import numpy as np
from scipy.linalg import lapack

from solfer.dynamics.dynamic_model import DynamicModel
from solfer.numerics.solvers.null_space import NullSpace

WEAK = 1e-6
"""How well contacts hold a motion of the DoFs without torque, from 0 to 1; below this they carry less and less of it.
A small load, as along the way of wheels that are nearly parallel, would need large forces."""


class CarryingTorques:
    """The smallest torques with which contacts that do not move bear the bias force of a robot.

    Without acceleration h = tau + J^T f, with the bias force h, the contacts' Jacobian J and forces f along its rows.
    The DoFs `free` have no torque: those of a floating base, joints without a drive. Where contacts bear more than the
    robot's weight needs, many forces do; chosen are those with the least |tau|.

    J^T = Q R, with r orthonormal columns Q that span the rows of J, and B the rows of Q that belong to `free`:

        tau = h - Q x,   x next to Q^T h of all that satisfy B x = h_free

    This is tau = (A without its columns `free`)^+ A h, with the null space A of J (A J^T = 0), for which no matrix of
    the size of the robot is needed. The eigenvalues of B B^T, from 0 to 1, tell how well the contacts hold `free`; in
    directions with less than WEAK the share s counts as s / WEAK^2 instead of 1 / s. See Mistry, Buchli, Schaal (2010),
    "Inverse dynamics control of floating base systems using orthogonal decomposition". Where no torques carry the
    robot, as on contacts in one line, they carry what they can.

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
        self.model, self.torque, self.carried = model, np.zeros(size), 0
        self._free, self._space = np.array(free, dtype=int), NullSpace(size)
        count = len(self._free)
        self._columns, self._along = np.zeros((size, count)), np.zeros(size)
        self._held, self._factor = np.zeros((2, count, count))
        self._shift = WEAK * np.eye(count)
        self._load, self._shares, self._ratios = np.zeros((3, count))
        self._well = np.zeros(count, dtype=bool)

    @property
    def rank(self) -> int:
        """See above."""
        return self._space.rank

    def update(self, jacobian: np.ndarray) -> np.ndarray:
        """Compute `torque` for the present state, and return it.

        Args:
            jacobian: That of the contacts, shape (k, n), k <= n; rows of zeros do not count.

        Raises:
            SizeMismatch: `jacobian` has another shape.
        """
        bias, torque, free = self.model.bias, self.torque, self._free
        rank = self._space.update(jacobian)
        np.copyto(torque, bias)
        self.carried = 0
        if rank:
            span, along = self._space.row_span(), self._along[:rank]
            np.dot(bias, span, out=along)
            if len(free):
                self._share(span, along)
            torque -= np.dot(span, along)
        torque[free] = 0.0
        return torque

    def _share(self, span: np.ndarray, along: np.ndarray) -> None:
        """Move x by the smallest vector to where it bears the DoFs `free`."""
        columns, load = self._columns[: self.rank], self._load
        np.take(span.T, self._free, axis=1, out=columns, mode="clip")
        np.take(self.model.bias, self._free, out=load, mode="clip")
        load -= np.dot(along, columns)
        np.dot(columns.T, columns, out=self._held)
        np.subtract(self._held, self._shift, out=self._factor)
        # symmetric matrices are their transposes, so LAPACK can work on their memory as it is
        if lapack.dpotrf(self._factor.T, clean=0, overwrite_a=1)[1] == 0:  # all are held well
            self.carried = len(load)
            load[:] = lapack.dposv(self._held.T, load, overwrite_a=1, overwrite_b=1)[1]
        else:
            self._share_weakly()
        along += np.dot(columns, load)

    def _share_weakly(self) -> None:
        """Solve for `load` by the eigenvectors of what holds the DoFs `free`; those that little holds fade out."""
        shares, vectors, _ = lapack.dsyev(self._held.T, overwrite_a=1)
        np.dot(self._load, vectors, out=self._shares)
        np.greater(shares, WEAK, out=self._well)
        self.carried = int(np.count_nonzero(self._well))
        np.divide(shares, WEAK**2, out=self._ratios)
        np.divide(1.0, shares, out=self._ratios, where=self._well)
        self._shares *= self._ratios
        np.dot(vectors, self._shares, out=self._load)

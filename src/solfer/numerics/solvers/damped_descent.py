"""Levels of tasks by null spaces whose projections are damped like their inverses, as the original program has them."""

import math

import numpy as np

from solfer.numerics.compilation import REORDERED, cached, part


@part
def _project(jacobian, start, end, columns, projector, projected):
    """Write J' = J P of a level, for the columns that count."""
    for i in range(end - start):
        for a in range(len(columns)):
            entry = 0.0
            for b in range(len(columns)):
                entry += jacobian[start + i, columns[b]] * projector[a, b]
            projected[i, a] = entry


@part
def _factorise(count, size, damping, projected, factor):
    """Write the lower factor of J' J'^T + D^2."""
    for i in range(count):
        for j in range(i + 1):
            entry = 0.0
            for a in range(size):
                entry += projected[i, a] * projected[j, a]
            if i == j:
                entry += damping[i] ** 2
            for k in range(j):
                entry -= factor[i, k] * factor[j, k]
            factor[i, j] = math.sqrt(entry) if i == j else entry / factor[j, j]


@part
def _lower(count, size, factor, projected, solved):
    """Write L^-1 J', where L is the lower factor."""
    for i in range(count):
        for a in range(size):
            solved[i, a] = projected[i, a]
        for k in range(i):
            entry = factor[i, k]
            for a in range(size):
                solved[i, a] -= entry * solved[k, a]
        entry = 1.0 / factor[i, i]
        for a in range(size):
            solved[i, a] *= entry


@part
def _advance(jacobian, velocity, start, count, columns, factor, solved, out):
    """Add J'^T (L L^T)^-1 (r - J dq) = (L^-1 J')^T L^-1 (r - J dq)."""
    size = len(columns)
    right = factor[-1]
    for i in range(count):
        entry = velocity[start + i]
        for a in range(size):
            entry -= jacobian[start + i, columns[a]] * out[columns[a]]
        for k in range(i):
            entry -= factor[i, k] * right[k]
        right[i] = entry / factor[i, i]
    for i in range(count):
        for a in range(size):
            out[columns[a]] += right[i] * solved[i, a]


def _descend(jacobian, velocity, damping, ends, columns, projector, projected, solved, factor, out):
    """Write the velocities of all levels; see `DampedDescent`."""
    size = len(columns)
    out[:] = 0.0
    for a in range(size):
        for b in range(size):
            projector[a, b] = 1.0 if a == b else 0.0
    for level in range(len(ends) - 1):
        start, end = ends[level], ends[level + 1]
        count = end - start
        _project(jacobian, start, end, columns, projector, projected)
        _factorise(count, size, damping[start:end], projected, factor)
        _lower(count, size, factor, projected, solved)
        _advance(jacobian, velocity, start, count, columns, factor, solved, out)
        if level == len(ends) - 2:
            break
        for a in range(size):
            for i in range(count):
                entry = solved[i, a]
                for b in range(size):
                    projector[a, b] -= entry * solved[i, b]


_MATRIX, _VECTOR = "float64[:, ::1]", "float64[::1]"

descend = cached(
    f"void({_MATRIX}, {_VECTOR}, {_VECTOR}, int64[::1], int64[::1], {_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX}, "
    f"{_VECTOR})",
    _descend,
    REORDERED,
)


class DampedDescent:
    """Joint velocities of levels of tasks, each in the damped null space of all before it.

    With dq = 0 and P = 1 at the start, each level with the rows J, the desired rates r and the damping D adds

        J' = J P,  X = J'^T (J' J'^T + D^2)^-1,  dq <- dq + X (r - J dq),  P <- P - X J'.

    The damping acts on P, too: a level with a large one leaves a share of its rows to those after it, and one that is
    nearly singular disturbs those before it a little. Source: S. Chiaverini, "Singularity-robust task-priority
    redundancy resolution for real-time kinematic control of robot manipulators", IEEE Transactions on Robotics and
    Automation 13(3), 1997.

    Args:
        ends: First row of each level, and the end of the last one, shape (levels + 1,).
        size: Number of DoFs n.
        columns: DoFs that move; the rows are zero in all others, shape (m,).

    Attributes:
        velocity: Joint velocities dq as of the last `update`, shape (n,); live.
    """

    def __init__(self, ends: np.ndarray, size: int, columns: np.ndarray):
        self._ends, self._columns = ends.astype(np.int64), columns.astype(np.int64)
        largest, count = int(np.diff(ends).max()), len(columns)
        self._projector = np.zeros((count, count))
        self._projected, self._solved = np.zeros((largest, count)), np.zeros((largest, count))
        self._factor = np.zeros((largest + 1, largest))
        self._damping, self.velocity = np.zeros(int(ends[-1])), np.zeros(size)

    def update(
        self, jacobian: np.ndarray, velocity: np.ndarray, damping: np.ndarray, columns: np.ndarray | None = None
    ) -> np.ndarray:
        """Compute and return the joint velocities.

        Args:
            jacobian: Rows of all levels, shape (rows, n).
            velocity: Desired rates r, shape (rows,).
            damping: Damping D of each row, in the units of the rows, shape (rows,).
            columns: DoFs that move this time, some of `columns` of the class; default: all of them.
        """
        self._damping[:] = damping
        descend(
            jacobian,
            velocity,
            self._damping,
            self._ends,
            self._columns if columns is None else columns,
            self._projector,
            self._projected,
            self._solved,
            self._factor,
            self.velocity,
        )
        return self.velocity

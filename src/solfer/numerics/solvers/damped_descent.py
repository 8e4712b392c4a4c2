"""Levels of tasks by null spaces whose projections are damped like their inverses, as the original program has them."""

import math

import numpy as np

from solfer.numerics.blocks import BlockLayout, MemoryBlock
from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.numerics.compilation import REORDERED, cached, part

LANES = 16
"""Rows have a multiple of so many columns: compiled loops take them so many at once, and what is left one by one."""


@part
def _gather(jacobian, velocity, damping, ends, columns, rows, used, numbers):
    """Write the columns that count of the rows that are not zero, their rates and damping; return their number."""
    count = 0
    width = len(columns)
    used[0] = 0
    for level in range(len(ends) - 1):
        for i in range(ends[level], ends[level + 1]):
            largest = 0.0
            for a in range(width):
                entry = jacobian[i, columns[a]]
                rows[count, a] = entry
                largest = max(largest, abs(entry))
            if largest > 0.0 or not math.isfinite(largest):
                numbers[0, count], numbers[1, count] = velocity[i], damping[i] ** 2
                count += 1
        used[level + 1] = count
    return count


@part
def _subtract(solved, row, start, end, factors):
    """Subtract the rows from `start` to `end`, times their factors, from another one."""
    width = solved.shape[1]
    k = start
    while k + 3 < end:
        p = factors[k]
        q = factors[k + 1]
        r = factors[k + 2]
        s = factors[k + 3]
        for a in range(width):
            solved[row, a] -= p * solved[k, a] + q * solved[k + 1, a] + r * solved[k + 2, a] + s * solved[k + 3, a]
        k += 4
    while k < end:
        p = factors[k]
        for a in range(width):
            solved[row, a] -= p * solved[k, a]
        k += 1


@part
def _decompose(rows, used, damping, solved, factor):
    """Write S = L^-1 J' of all levels, and L, the lower factor of J' J'^T + D^2 of each.

    P = 1 - S^T S with all rows S of the levels before, so that J' = J - (J S^T) S. A row of L is J' S^T, and S follows
    from it row by row, since the rows of (S, L^-1 D) are orthonormal.
    """
    width = rows.shape[1]
    for level in range(len(used) - 1):
        start = used[level]
        end = used[level + 1]
        for i in range(start, end):
            for a in range(width):
                solved[i, a] = rows[i, a]
            for k in range(start):
                entry = 0.0
                for a in range(width):
                    entry += rows[i, a] * solved[k, a]
                factor[i, k] = entry
            _subtract(solved, i, 0, start, factor[i])
            rest = 0.0
            for a in range(width):
                rest += solved[i, a] * solved[i, a]
            for k in range(start, i):
                entry = 0.0
                for a in range(width):
                    entry += solved[i, a] * solved[k, a]
                factor[i, k] = entry
                rest -= entry * entry
            _subtract(solved, i, start, i, factor[i])
            # the remainder of J' J'^T is not negative: less than D^2 is a rounding error
            pivot = math.sqrt(damping[i] + (0.0 if rest < 0.0 else rest))
            factor[i, i] = pivot
            for a in range(width):
                solved[i, a] /= pivot


@part
def _advance(rows, used, rates, solved, factor, weights, out):
    """Write the sum of all steps J'^T (L L^T)^-1 (r - J dq) = S^T L^-1 (r - J dq)."""
    width = rows.shape[1]
    for a in range(width):
        out[a] = 0.0
    for level in range(len(used) - 1):
        start = used[level]
        end = used[level + 1]
        for i in range(start, end):
            entry = rates[i]
            for a in range(width):
                entry -= rows[i, a] * out[a]
            for k in range(start, i):
                entry -= factor[i, k] * weights[k]
            weights[i] = entry / factor[i, i]
        for i in range(start, end):
            entry = weights[i]
            for a in range(width):
                out[a] += entry * solved[i, a]


@part
def _scale(columns, speed, found):
    """Return the largest scale up to 1 with which no velocity is faster than it may be, of joints that may move.

    And the place of the one that it is for; -1: there is none.
    """
    scale = 1.0
    place = -1
    for a in range(len(columns)):
        size = abs(found[a])
        most = speed[columns[a]]
        if size * scale > most > 0.0:
            scale = most / size
            place = a
    return scale, place


@part
def _shorten(columns, lower, upper, found):
    """Scale velocities so that all are within their bounds; return the scale, and the place of what it is for."""
    scale = 1.0
    place = -1
    for a in range(len(columns)):
        bound = upper[columns[a]] if found[a] > 0.0 else -lower[columns[a]]
        if abs(found[a]) * scale > bound:
            scale = bound / abs(found[a])
            place = a
    return scale, place


@part
def _slides(rows, rates, count, found, is_free):
    """Whether the first rows, whose rates are zero but for what is held, are off by more than 1e-3 m/s."""
    for i in range(count):
        entry = -rates[i]
        for a in range(rows.shape[1]):
            if is_free[a]:
                entry += rows[i, a] * found[a]
        if abs(entry) > 1e-3:
            return True
    return False


@part
def _farthest(columns, lower, upper, is_free, found, scale):
    """Find the place of the velocity that is farthest beyond its bounds; -1: there is none."""
    place = -1
    farthest = 1e-9  # [rad/s, m/s]
    for a in range(len(columns)):
        if is_free[a]:
            value = scale * found[a]
            beyond = max(value - upper[columns[a]], lower[columns[a]] - value)
            if beyond > farthest:
                place = a
                farthest = beyond
    return place


DESCENT = BlockLayout(
    "Descent",
    level_count=int,
    row_count=int,
    width=int,  # number of DoFs that move
    padded=int,  # columns of the rows: those behind the DoFs are zero, see `LANES`
    dofs=int,
    rigid=int,
    ends=(int, "level_count + 1"),
    columns=(int, "width"),
    # rows that count: their entries, S, L; rates, squares of dampings, weights; and where levels end
    rows=(float, "row_count", "padded"),
    solved=(float, "row_count", "padded"),
    factor=(float, "row_count", "row_count"),
    numbers=(float, 3, "row_count"),
    used=(int, "level_count + 1"),
    # velocities of the columns: by all levels, where they are held, those without bounds, and which are free
    found=(float, "padded"),
    held=(float, "width"),
    first=(float, "padded"),
    is_free=(bool, "padded"),
    out=(float, "dofs"),
)
"""What `descend` computes in, and its result."""

_descent_at = DESCENT.at


def _descend(start, jacobian, velocity, damping, bounds):
    """Write the velocities; return the number of joints at their bounds, the scale, and the DoF that bounds it.

    See `DampedDescent`.
    """
    block = _descent_at(start)
    columns = block.columns
    rows = block.rows
    numbers = block.numbers
    used = block.used
    found = block.found
    held = block.held
    first = block.first
    is_free = block.is_free
    out = block.out
    size = _gather(jacobian, velocity, damping, block.ends, columns, rows, used, numbers)
    width = len(columns)
    rows = rows[:size]
    solved = block.solved[:size]
    factor = block.factor[:size]
    rates = numbers[0]
    squares = numbers[1]
    weights = numbers[2]
    _decompose(rows, used, squares, solved, factor)
    _advance(rows, used, rates, solved, factor, weights, found)
    for k in range(len(out)):
        out[k] = 0.0
    count = 0
    scale = 1.0
    last = -1
    if len(bounds):
        lower = bounds[0]
        upper = bounds[1]
        speed = bounds[2]
        for a in range(width):
            is_free[a], first[a] = True, found[a]
        while True:
            scale, place = _scale(columns, speed, found)
            last = place if place >= 0 else last
            place = _farthest(columns, lower, upper, is_free, found, scale)
            if place < 0:
                break
            last = place
            value = upper[columns[place]] if found[place] > 0.0 else lower[columns[place]]
            held[place] = value
            is_free[place] = False
            for i in range(size):
                rates[i] -= value * rows[i, place]
                rows[i, place] = 0.0
            count += 1
            _decompose(rows, used, squares, solved, factor)
            _advance(rows, used, rates, solved, factor, weights, found)
            for a in range(width):
                if not is_free[a]:
                    found[a] = held[a]
            if _slides(rows, rates, used[block.rigid], found, is_free):
                scale, last = _shorten(columns, lower, upper, first)
                found[:] = first
                break
    for a in range(width):
        out[columns[a]] = scale * found[a]
    return count, scale, columns[last] if last >= 0 else -1


descend = cached(
    "Tuple((int64, float64, int64))(int64, float64[:, ::1], float64[::1], float64[:], float64[:, ::1])",
    _descend,
    REORDERED,
)


class DampedDescent:
    """Joint velocities of levels of tasks, each in the damped null space of all before it.

    With dq = 0 and P = 1 at the start, each level with the rows J, the desired rates r and the damping D adds

        J' = J P,  X = J'^T (J' J'^T + D^2)^-1,  dq <- dq + X (r - J dq),  P <- P - X J'.

    The damping acts on P, too: a level with a large one leaves a part of its rows to those after it, and one that is
    nearly singular disturbs those before it a little. Source: S. Chiaverini, "Singularity-robust task-priority
    redundancy resolution for real-time kinematic control of robot manipulators", IEEE Transactions on Robotics and
    Automation 13(3), 1997.

    With bounds no velocity is beyond its own. Where one is faster than it may be, all are scaled down together, which
    leaves zero rates zero. Where one leads out of its range, it stays at its bound, the one farthest beyond first, and
    the levels are solved again by the others. Source: F. Flacco, A. De Luca, O. Khatib, "Control of redundant robots
    under hard joint constraints: saturation in the null space", IEEE Transactions on Robotics 31(3), 2015; there, a
    velocity that is too fast also stays at its bound, as long as the others can make up for it. With levels that
    leave nothing free these need to be much faster, which makes all of them jump from one bound to the other. Where
    what is held at the end of a range would break the first levels, such as those of contacts that do not slide, all
    joints keep the velocities without bounds, scaled down.

    Args:
        ends: First row of each level, and the end of the last one, shape (levels + 1,).
        size: Number of DoFs n.
        columns: DoFs that move; the rows are zero in all others, shape (m,).
        rigid: How many of the first levels are never given up; their rates are zero.

    Attributes:
        velocity: Joint velocities dq as of the last `update`, shape (n,); live.
        count: How many velocities stayed at a bound of their ranges in the last `update`.
        scale: What all velocities were scaled by in the last `update`.
        last: The DoF that reached its bound last, or is scaled down to it; -1 if none does.
    """

    def __init__(self, ends: np.ndarray, size: int, columns: np.ndarray, rigid: int = 0):
        rows = int(ends[-1])
        width = len(columns)
        padded = -(-width // LANES) * LANES
        self._unbounded = np.zeros((0, size))
        self.velocity = np.zeros(size)
        self._block = MemoryBlock(
            DESCENT,
            level_count=len(ends) - 1,
            row_count=rows,
            width=width,
            padded=padded,
            dofs=size,
            rigid=rigid,
            ends=ends.astype(np.int64),
            columns=columns.astype(np.int64),
            rows=np.zeros((rows, padded)),
            solved=np.zeros((rows, padded)),
            factor=np.zeros((rows, rows)),
            numbers=np.zeros((3, rows)),
            used=np.zeros(len(ends), dtype=np.int64),
            found=np.zeros(padded),
            held=np.zeros(width),
            first=np.zeros(padded),
            is_free=np.zeros(padded, dtype=np.bool_),
            out=self.velocity,
        )
        self.count = 0
        self.scale = 1.0
        self.last = -1

    def update(
        self, jacobian: np.ndarray, velocity: np.ndarray, damping: np.ndarray, bounds: VelocityBounds | None = None
    ) -> np.ndarray:
        """Compute and return the joint velocities. Allocates nothing.

        Args:
            jacobian: Rows of all levels, shape (rows, n).
            velocity: Desired rates r, shape (rows,).
            damping: Damping D of each row, in the units of the rows, shape (rows,).
            bounds: Bounds of the velocities, up to date; None: there are none.
        """
        limits = self._unbounded if bounds is None else bounds.limits
        self.count, self.scale, self.last = descend(self._block.address, jacobian, velocity, damping, limits)
        return self.velocity

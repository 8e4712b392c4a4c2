"""Compiled steps of `WeightedForces` and `TorqueOffsets`, number by number. Arrays are described there."""

from solfer.numerics.compilation import cached, part
from solfer.numerics.dense import DENSE, backward, cholesky, forward


@part
def _normal_matrix(jacobian, weights, columns, diagonal, factor):
    """Write the factor of J S J^T plus a number on the diagonal."""
    rows = len(jacobian)
    for i in range(rows):
        for j in range(i + 1):
            factor[i, j] = diagonal if i == j else 0.0
        for column in columns:
            weighted = jacobian[i, column] * weights[column]
            if weighted != 0.0:
                for j in range(i + 1):
                    factor[i, j] += weighted * jacobian[j, column]
    cholesky(factor)


def _fit(jacobian, world, weights, columns, diagonal, factor, forces, rest):
    """Write the forces that explain the world best, and what they leave."""
    _normal_matrix(jacobian, weights, columns, diagonal, factor)
    for i in range(len(forces)):
        forces[i] = 0.0
        for column in columns:
            forces[i] += jacobian[i, column] * weights[column] * world[column]
    forward(factor, forces)
    backward(factor, forces)
    for column in range(len(rest)):
        rest[column] = world[column]
    for i in range(len(forces)):
        for column in columns:
            rest[column] -= jacobian[i, column] * forces[i]


def _learn(
    jacobian, world, weights, columns, diagonal, first, fraction, decay, prior, factor, spread, needed, information,
    learned, solved, offsets,
):  # fmt: skip
    """Add what a cycle reports of the offsets of the joints `columns[first:]`, and write the likeliest ones."""
    rows = len(jacobian)
    size = len(learned)
    _normal_matrix(jacobian, weights, columns, diagonal, factor)
    for i in range(rows):
        needed[i] = 0.0
        for column in columns:
            needed[i] += jacobian[i, column] * weights[column] * world[column]
        for a in range(size):
            column = columns[first + a]
            spread[a, i] = jacobian[i, column] * weights[column]
    forward(factor, needed)
    for a in range(size):
        forward(factor, spread[a])
    for a in range(size):
        column = columns[first + a]
        left = weights[column] * world[column]
        for i in range(rows):
            left -= spread[a, i] * needed[i]
        learned[a] += -fraction * left - decay * learned[a]
        for b in range(a + 1):
            left = weights[column] if a == b else 0.0
            for i in range(rows):
                left -= spread[a, i] * spread[b, i]
            information[a, b] += fraction * left - decay * information[a, b]
            solved[a, b] = information[a, b]
        solved[a, a] += prior
    cholesky(solved)
    for a in range(size):
        offsets[a] = learned[a]
    forward(solved, offsets)
    backward(solved, offsets)


_MATRIX = "float64[:, ::1]"
_VECTOR = "float64[::1]"
_INDICES = "int64[::1]"

fit = cached(
    f"void({_MATRIX}, {_VECTOR}, {_VECTOR}, {_INDICES}, float64, {_MATRIX}, {_VECTOR}, {_VECTOR})",
    _fit,
    sources=[DENSE],
)
learn = cached(
    f"void({_MATRIX}, {_VECTOR}, {_VECTOR}, {_INDICES}, float64, int64, float64, float64, float64, "
    f"{_MATRIX}, {_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR})",
    _learn,
    sources=[DENSE],
)

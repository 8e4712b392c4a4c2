"""Decompositions of small symmetric matrices, number by number, for compiled functions.

A function that is compiled with them names `DENSE` among its sources.
"""

import math
from pathlib import Path

from solfer.numerics.compilation import part

DENSE = Path(__file__)


@part
def cholesky(matrix, least=0.0):
    """Write the lower factor of a matrix into its lower triangle; return whether all its pivots are above `least`."""
    for i in range(len(matrix)):
        for j in range(i + 1):
            left = matrix[i, j]
            for k in range(j):
                left -= matrix[i, k] * matrix[j, k]
            if i > j:
                matrix[i, j] = left / matrix[j, j]
            elif left > least:
                matrix[i, i] = math.sqrt(left)
            else:  # also not a number
                return False
    return True


@part
def forward(factor, vector):
    """Solve L x = b in place."""
    for i in range(len(vector)):
        left = vector[i]
        for k in range(i):
            left -= factor[i, k] * vector[k]
        vector[i] = left / factor[i, i]


@part
def backward(factor, vector):
    """Solve L^T x = b in place."""
    for i in range(len(vector) - 1, -1, -1):
        vector[i] /= factor[i, i]
        for k in range(i):  # along a row, which lies together in memory
            vector[k] -= factor[i, k] * vector[i]

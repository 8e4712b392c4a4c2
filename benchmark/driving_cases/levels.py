"""Levels of tasks by damped null spaces, with dense matrices, and more digits than the compiled ones have."""

from itertools import pairwise

import numpy as np


def inverse(matrix):
    """Invert a matrix by Gauss and Jordan with pivoting."""
    size = len(matrix)
    work = np.hstack((matrix, np.eye(size, dtype=matrix.dtype)))
    for column in range(size):
        pivot = column + abs(work[column:, column]).argmax()
        work[[column, pivot]] = work[[pivot, column]]
        work[column] /= work[column, column]
        others = np.arange(size) != column
        work[others] -= work[others, column, None] * work[column]
    return work[:, size:]


def dense_levels(jacobian, rates, damping, ends, columns):
    """Solve the equations of `DampedDescent`."""
    jacobian, damping = jacobian.astype(np.longdouble), damping.astype(np.longdouble)
    size = jacobian.shape[1]
    velocity, projector = np.zeros(size, np.longdouble), np.zeros((size, size), np.longdouble)
    projector[columns, columns] = 1.0
    for start, end in pairwise(ends):
        rows = jacobian[start:end]
        projected = rows @ projector
        found = projected.T @ inverse(projected @ projected.T + np.diag(damping[start:end] ** 2))
        velocity = velocity + found @ (rates[start:end] - rows[:, columns] @ velocity[columns])
        projector = projector - found @ projected
    return velocity.astype(float)


def dense_within(jacobian, rates, damping, ends, columns, *, bounds, rigid=0):
    """Solve them within bounds: joints at the ends of their ranges first, then all slower; return count and scale.

    Where that breaks the first rows, all is slower alone.
    """
    held, value = [], np.zeros(jacobian.shape[1])
    first = dense_levels(jacobian, rates, damping, ends, columns)
    while True:
        free = np.setdiff1d(columns, held)
        velocity = dense_levels(jacobian, rates - jacobian @ value, damping, ends, free) + value
        if held and abs(jacobian[:rigid] @ velocity).max(initial=0.0) > 1e-3:
            size = np.abs(first[columns])
            bound = np.where(first > 0.0, bounds.upper, -bounds.lower)[columns]
            scale = min(1.0, *(bound[size > 0.0] / size[size > 0.0]))
            return scale * first, len(held), scale
        moving = free[bounds.speed[free] > 0.0]
        scale = min(1.0, *(bounds.speed[moving] / np.maximum(np.abs(velocity[moving]), 1e-300)))
        beyond = np.maximum(scale * velocity - bounds.upper, bounds.lower - scale * velocity)[free]
        if beyond.max() <= 1e-9:
            return scale * velocity, len(held), scale
        dof = free[beyond.argmax()]
        value[dof] = bounds.upper[dof] if velocity[dof] > 0.0 else bounds.lower[dof]
        held.append(dof)

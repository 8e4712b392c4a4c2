"""Whether the solution of a quadratic program fulfils the conditions of Karush, Kuhn and Tucker, by SciPy."""

import numpy as np
from scipy.optimize import nnls


def imbalance(problem, x):
    """Compute the rest of the gradient beside non-negative combinations of the active constraints' normals."""
    slope, normals = problem.hessian @ x + problem.gradient, active_normals(problem, x)
    return nnls(normals, -slope)[1] if normals.size else np.linalg.norm(slope)


def active_normals(problem, x, tolerance=1e-8):
    """Columns that a non-negative combination of has to balance the gradient of the cost."""
    columns = [*problem.equality_matrix, *-problem.equality_matrix]
    value = problem.inequality_matrix @ x
    rows = [*problem.inequality_matrix, *np.eye(len(x))]
    values, lower = [*value, *x], [*problem.lower, *problem.x_min]
    for row, entry, low, high in zip(rows, values, lower, [*problem.upper, *problem.x_max], strict=True):
        if entry < low + tolerance:
            columns.append(-row)
        if entry > high - tolerance:
            columns.append(row)
    return np.array(columns).T.reshape(len(x), -1)

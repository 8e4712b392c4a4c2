"""The QP solver: optimality by SciPy's non-negative least squares, infeasibility by its linear programs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import linprog
from support.unit.optimality import imbalance

from solfer.errors import SizeMismatch
from solfer.numerics.solvers.qp import QpSolver, QpStatus

MOST_STEPS = 8 * (10 + 3)
"""Steps that the solver makes at most for a problem of 10 unknowns and 3 inequalities."""

SEEDS = 200
"""Random problems of each kind."""


CURVATURES = (1e-3, 1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
"""What is added to the diagonal of a singular matrix."""


def feasible(seed, curvature=1e-3, repeats=0):
    """Draw a problem with a point that fulfils it; the cost is almost flat in some directions.

    Args:
        seed: Seed.
        curvature: Added to the diagonal of a matrix B^T B of any rank.
        repeats: Equalities that repeat another one, scaled.
    """
    random = np.random.default_rng(seed)
    size = int(random.integers(2, 16))
    equalities, inequalities = int(random.integers(0, size // 2 + 1)), int(random.integers(0, 8))
    repeats *= equalities > 0
    solver = QpSolver(size, equalities + repeats, inequalities)
    problem, point = solver.problem, random.uniform(-1.0, 1.0, size)
    root = random.normal(size=(int(random.integers(1, size + 1)), size))
    problem.hessian[:] = root.T @ root + curvature * np.eye(size)
    problem.gradient[:] = random.normal(size=size)
    problem.equality_matrix[:equalities] = random.normal(size=(equalities, size))
    for row in range(equalities, equalities + repeats):
        problem.equality_matrix[row] = random.uniform(-2.0, 2.0) * problem.equality_matrix[random.integers(equalities)]
    problem.equality_vector[:] = problem.equality_matrix @ point
    problem.inequality_matrix[:] = random.normal(size=(inequalities, size))
    value = problem.inequality_matrix @ point
    problem.lower[:], problem.upper[:] = (
        value - random.uniform(0, 1, inequalities),
        value + random.uniform(0, 1, inequalities),
    )
    problem.x_min[:], problem.x_max[:] = point - random.uniform(0, 1, size), point + random.uniform(0, 1, size)
    open_ends = random.random(size) < 0.3
    problem.x_max[open_ends] = np.inf
    return solver


def infeasible(seed):
    """Draw a problem in which two constraints, a bound out of reach, or a row of an equality contradict the rest."""
    random = np.random.default_rng(seed)
    solver = QpSolver(10, 2, 3)
    problem = solver.problem
    problem.hessian[:], problem.gradient[:] = np.eye(10), random.normal(size=10)
    problem.equality_matrix[:] = random.normal(size=(2, 10))
    problem.inequality_matrix[:] = random.normal(size=(3, 10))
    problem.lower[:], problem.upper[:] = -1.0, 1.0
    problem.x_min[:], problem.x_max[:] = -0.5, 0.5
    if seed % 3 == 0:
        problem.inequality_matrix[1] = -problem.inequality_matrix[0]
        problem.lower[:2], problem.upper[:2] = 0.1, 1.0
    elif seed % 3 == 1:
        problem.lower[0] = 0.5 * np.abs(problem.inequality_matrix[0]).sum() + random.uniform(0.01, 1.0)
        problem.upper[0] = np.inf
    else:
        problem.inequality_matrix[2] = problem.equality_matrix[0]
        problem.lower[2], problem.upper[2] = 0.05, 1.0
    return solver


def broken_conditions(problem, solution):
    """List the conditions of an optimum that a solution of a problem breaks."""
    x = solution.x
    value = problem.inequality_matrix @ x
    lack = problem.equality_matrix @ x - problem.equality_vector
    largest = max(np.abs(problem.gradient).max(), problem.hessian.max() * np.abs(x).max())
    kept = {
        "status": solution.status is QpStatus.SOLVED and solution.is_solved,
        "residual": 0.0 <= solution.residual <= 1e-9,
        "problem": solution.problem is problem,
        "equalities": (np.abs(lack) <= within(problem.equality_vector)).all(),
        "inequalities": (
            (value >= problem.lower - within(problem.lower)) & (value <= problem.upper + within(problem.upper))
        ).all(),
        "bounds": ((x >= problem.x_min - within(problem.x_min)) & (x <= problem.x_max + within(problem.x_max))).all(),
        "slope": imbalance(problem, x) < 1e-8 * largest,
    }
    return [name for name, holds in kept.items() if not holds]


def within(sides):
    """Return by how much a solution may violate constraints: the tolerance, and rounding errors of the test."""
    sides = np.abs(np.where(np.isfinite(sides), sides, 0.0))
    return 1e-9 * np.maximum(1.0, sides) + 1e-14


@pytest.mark.parametrize("repeats", [0, 2])
@pytest.mark.parametrize("curvature", CURVATURES)
def test_solved_is_said_of_optima_only(curvature, repeats):
    broken, solved = {}, 0
    for seed in range(SEEDS):
        solver = feasible(seed, curvature, repeats)
        solver.problem.gradient *= 10.0 ** (seed % 5)
        solution = solver.solve()
        if solution.is_solved:
            solved += 1
            broken[seed] = broken_conditions(solver.problem, solution)
        else:
            # all of these problems have a solution
            assert solution.status in (QpStatus.INACCURATE, QpStatus.NOT_CONVERGED)
    assert {seed: names for seed, names in broken.items() if names} == {}
    # what is flatter than 1e-13 of the largest curvature is given up
    assert solved >= (0.98 if curvature > 1e-12 else 0.85) * SEEDS


def test_what_misses_its_tolerance_is_called_inaccurate():
    solver = feasible(7)
    sizes = [len(getattr(solver.problem, name)) for name in ("gradient", "equality_vector", "lower")]
    strict = QpSolver(*sizes, tolerance=1e-18)
    for name, array in vars(solver.problem).items():
        setattr(strict.problem, name, array)
    solution = strict.solve()
    assert solution.status is QpStatus.INACCURATE and not solution.is_solved
    assert 1e-18 < solution.residual < 1e-9
    assert_array_equal(solution.problem.hessian, solver.problem.hessian)
    assert solution.problem is not strict.problem
    assert_allclose(solution.x, solver.solve().x, atol=1e-8)


def is_contradictory(problem):
    """Return whether SciPy proves that no point fulfils everything."""
    both = np.vstack((problem.inequality_matrix, -problem.inequality_matrix))
    limits = np.concatenate((problem.upper, -problem.lower))
    known = np.isfinite(limits)
    program = linprog(
        np.zeros(10),
        both[known],
        limits[known],
        problem.equality_matrix,
        problem.equality_vector,
        np.column_stack((problem.x_min, problem.x_max)),
    )
    return program.status == 2


@pytest.mark.slow
def test_a_contradiction_is_found_within_bounded_iterations():
    solvers = {seed: infeasible(seed) for seed in range(SEEDS)}
    assert [seed for seed, solver in solvers.items() if not is_contradictory(solver.problem)] == []
    solutions = {seed: solver.solve() for seed, solver in solvers.items()}
    assert {
        seed: (solution.status, solution.iterations)
        for seed, solution in solutions.items()
        if solution.status is not QpStatus.INFEASIBLE or solution.is_solved or solution.iterations > MOST_STEPS
    } == {}


def test_a_failure_affects_no_later_problem():
    solver, problem = infeasible(1), infeasible(1).problem
    failed = solver.solve()
    solver.problem.lower[0] = -1.0
    solved = solver.solve()
    assert solved.is_solved
    assert_array_equal(failed.problem.lower, problem.lower)
    fresh = infeasible(1)
    fresh.problem.lower[0] = -1.0
    assert_array_equal(fresh.solve().x, solved.x)


def test_equal_problems_have_equal_solutions():
    solver = feasible(7)
    first = solver.solve().x
    gradient = solver.problem.gradient.copy()
    solver.problem.gradient[:] = 100.0
    assert np.abs(solver.solve().x - first).max() > 1e-3
    solver.problem.gradient[:] = gradient
    assert_array_equal(solver.solve().x, first)


@pytest.mark.parametrize(
    "array",
    [
        "hessian",
        "gradient",
        "equality_matrix",
        "equality_vector",
        "inequality_matrix",
        "lower",
        "upper",
        "x_min",
        "x_max",
    ],
)
def test_nan_is_found_at_once(array):
    solver = infeasible(0)
    getattr(solver.problem, array).flat[0] = np.nan
    solution = solver.solve()
    assert solution.status is QpStatus.NOT_FINITE and solution.iterations == 0
    assert np.isnan(getattr(solution.problem, array).flat[0])


@pytest.mark.parametrize(("low", "high"), [("lower", "upper"), ("x_min", "x_max")])
def test_contradicting_bounds_are_found_at_once(low, high):
    solver = feasible(3)
    problem = solver.problem
    getattr(problem, low)[0], getattr(problem, high)[0] = 1.0, 0.9
    solution = solver.solve()
    assert solution.status is QpStatus.INFEASIBLE and solution.iterations == 0


def test_without_constraints_the_minimum_is_plain():
    solver = QpSolver(3)
    solver.problem.hessian[:], solver.problem.gradient[:] = np.diag((1.0, 2.0, 4.0)), (1.0, 2.0, -4.0)
    assert_allclose(solver.solve().x, (-1.0, -1.0, 1.0), atol=1e-8)


def test_equalities_that_repeat_each_other_are_no_contradiction():
    solver = feasible(7)
    problem = solver.problem
    twice = QpSolver(len(problem.gradient), 2 * len(problem.equality_vector), len(problem.lower))
    for name in ("hessian", "gradient", "inequality_matrix", "lower", "upper", "x_min", "x_max"):
        setattr(twice.problem, name, getattr(problem, name))
    twice.problem.equality_matrix[:] = np.vstack((problem.equality_matrix, -2.0 * problem.equality_matrix))
    twice.problem.equality_vector[:] = np.concatenate((problem.equality_vector, -2.0 * problem.equality_vector))
    assert len(problem.equality_vector) > 0
    assert_allclose(twice.solve().x, solver.solve().x, atol=1e-8)
    twice.problem.equality_vector[0] += 0.01
    assert twice.solve().status is QpStatus.INFEASIBLE


@pytest.mark.parametrize("curvature", [0.0, 1e-15, -1.0])
def test_a_flat_cost_is_given_up(curvature):
    solver = QpSolver(2)
    solver.problem.hessian[:] = np.diag((1.0, curvature))
    solution = solver.solve()
    assert solution.status is QpStatus.NOT_CONVERGED and solution.iterations == 0


@pytest.mark.parametrize("array", [np.zeros((2, 3)), np.zeros((3, 6))[:, ::2], np.zeros((3, 3), dtype=np.float32)])
def test_arrays_that_do_not_fit_are_refused(array):
    solver = QpSolver(3)
    solver.problem.hessian = array
    with pytest.raises(SizeMismatch):
        solver.solve()

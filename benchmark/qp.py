#!/usr/bin/env python3
"""QP solvers on 1 000 problems of the components: what they solve, how exactly, and how long they take.

Run with `./run exec python benchmark/qp.py [--json] [--seed N] [--only SOLVERS]`. The problems are recorded from
`inverse_dynamics`, levels of tasks and `support_shaping` on CENTAURO and on an arm; some of them are made infeasible,
their constraints almost dependent, or their cost almost flat. Whether a problem is feasible is decided by HiGHS; x is
right where the conditions of Karush, Kuhn and Tucker hold, by SciPy's non-negative least squares. quadprog and ProxQP
take part where they can be imported. The exit code is 1 if `QpSolver` is wrong once.

Columns: problems called solved, called infeasible, given up; wrong (a residual above 1e-6, or feasible problems called
infeasible and the reverse); residuals above 1e-9, and the largest one of all that are not wrong; bytes that one call
takes from Python's allocator; times of a call [us].
"""

import gc
import sys
import time
import tracemalloc
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from form import Figures, parser_of
from scipy.optimize import linprog, lsq_linear, nnls

from solfer.numerics.solvers.qp import Problem

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test"))

from qp_cases import solvers  # noqa: E402
from qp_cases.problems import draw  # noqa: E402
from qp_cases.solvers import INFEASIBLE, SOLVED, UNKNOWN  # noqa: E402
from support.unit.optimality import active_normals  # noqa: E402

SOLVERS: dict[str, Any] = {
    "QpSolver": solvers.Ours,
    "QpSolver, from compiled code": solvers.OursCompiled,
    "daqp.solve": solvers.Daqp,
    "daqp.Model": solvers.DaqpModel,
    "daqp in C, from compiled code": solvers.DaqpC,
    "daqp in C, equalities eliminated": solvers.DaqpEliminated,
    "quadprog": solvers.Quadprog,
    "proxsuite": solvers.Proxqp,
}
"""Solvers by their names."""

WRONG, LOOSE, CALLS = 1e-6, 1e-9, 3
"""Residuals of what is wrong and of what is not exact, and calls that are timed, of which the median counts."""


def violation(problem: Problem, x: np.ndarray) -> float:
    """Return by how much x violates the constraints, as ratios of their sides where these are larger than 1."""
    value = problem.inequality_matrix @ x
    pairs = (
        (np.abs(problem.equality_matrix @ x - problem.equality_vector), problem.equality_vector),
        (problem.lower - value, problem.lower),
        (value - problem.upper, problem.upper),
        (problem.x_min - x, problem.x_min),
        (x - problem.x_max, problem.x_max),
    )
    known = [lack[np.isfinite(side)] / np.maximum(1.0, np.abs(side[np.isfinite(side)])) for lack, side in pairs]
    return max(0.0, float(np.max(np.concatenate(known), initial=0.0)))


def residual(problem: Problem, x: np.ndarray) -> float:
    """Return the largest of what x leaves of the conditions of an optimum, see `Solution.residual`."""
    largest = max(np.abs(problem.gradient).max(), problem.hessian.max() * np.abs(x).max())
    slope = problem.hessian @ x + problem.gradient
    normals = active_normals(problem, x)
    if normals.size:
        try:
            slope = slope + normals @ nnls(normals, -slope)[0]
        except RuntimeError:  # it takes too many iterations where normals depend on each other
            slope = slope + normals @ lsq_linear(normals, -slope, (0.0, np.inf), method="bvls", tol=1e-14).x
    return max(violation(problem, x), float(np.abs(slope).max() / largest) if largest > 0.0 else 0.0)


def is_feasible(problem: Problem) -> bool:
    """Return whether HiGHS finds a point that violates no constraint by more than 1e-8."""
    rows = np.vstack((problem.inequality_matrix, np.eye(len(problem.gradient))))
    lower = np.concatenate((problem.lower, problem.x_min))
    upper = np.concatenate((problem.upper, problem.x_max))
    above, below = np.isfinite(lower), np.isfinite(upper)
    sides = problem.equality_vector
    matrix = np.vstack((-rows[above], rows[below], problem.equality_matrix, -problem.equality_matrix))
    limits = np.concatenate((-lower[above], upper[below], sides, -sides))
    slack = np.maximum(1.0, np.abs(limits))[:, None]
    cost = np.append(np.zeros(rows.shape[1]), 1.0)
    options = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    bounds = [(None, None)] * rows.shape[1] + [(0.0, None)]
    for method in ("highs-ds", "highs-ipm"):
        found = linprog(cost, np.hstack((matrix, -slack)), limits, bounds=bounds, method=method, options=options)
        if found.status == 0:
            return bool(found.fun < 1e-8)
    raise RuntimeError(f"HiGHS does not decide: {found.message}")


def timed(solver: Any) -> float:
    """Return the median time of a call [us]."""
    times = []
    for _ in range(CALLS):
        start = time.perf_counter_ns()
        solver.solve()
        times.append(1e-3 * (time.perf_counter_ns() - start))
    return float(np.median(times))


def allocated(solver: Any) -> int:
    """Return the bytes that a call takes at most from Python's allocator."""
    tracemalloc.start()
    tracemalloc.reset_peak()
    before, _ = tracemalloc.get_traced_memory()
    result = solver.solve()
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    del result
    return most - before


def measure(kind: Any, problems: list[tuple[Problem, bool]]) -> list[tuple[str, bool, float, int, float]]:
    """Solve problems, of which it is known whether they are feasible.

    Returns:
        Of each the outcome, whether it is wrong, the residual of a solution, bytes, and the time of a call.
    """
    rows = []
    for problem, feasible in problems:
        solver = kind(problem)
        outcome, x = solver.outcome(solver.solve())
        left = 0.0
        if outcome == SOLVED:
            left = residual(problem, x) if np.isfinite(x).all() else np.inf
        wrong = outcome == (INFEASIBLE if feasible else SOLVED) or left > WRONG
        rows.append((outcome, wrong, left, allocated(solver), timed(solver)))
    return rows


def summary(rows: list[tuple[str, bool, float, int, float]]) -> dict[str, float]:
    """Return the figures of solved problems."""
    outcomes, wrong, left, taken, times = (np.array(column) for column in zip(*rows, strict=True))
    right = left[~wrong]
    p50, p99, most = np.percentile(times, (50, 99, 100))
    return {
        **{outcome: int(np.sum(outcomes == outcome)) for outcome in (SOLVED, INFEASIBLE, UNKNOWN)},
        "wrong": int(wrong.sum()),
        "loose": int(np.sum(right > LOOSE)),
        "worst": float(right.max(initial=0.0)),
        "bytes": int(np.median(taken)),
        "p50": float(p50),
        "p99": float(p99),
        "max": float(most),
    }


def main() -> int:
    """Print a row for each case and solver, and one for all cases together."""
    parser = parser_of(__doc__)
    parser.add_argument("--seed", type=int, default=1, help="of the states (default: %(default)s)")
    parser.add_argument("--only", default="", help="solvers whose names begin so, with commas (default: all)")
    given = parser.parse_args()
    figures = Figures(given.json)
    cases = {name: [(each, is_feasible(each)) for each in found] for name, found in draw(given.seed)}
    missing = tuple(name for name in ("quadprog", "proxsuite") if find_spec(name) is None)
    names = [name for name in SOLVERS if name not in missing and name.startswith(tuple(given.only.split(",")))]
    known = [feasible for problems in cases.values() for _, feasible in problems]
    print(f"{len(known)} problems, of which {known.count(False)} are infeasible", file=sys.stderr)
    gc.disable()
    everything: dict[str, list[tuple[str, bool, float, int, float]]] = {name: [] for name in names}
    for case, problems in cases.items():
        for name in names:
            rows = measure(SOLVERS[name], problems)
            everything[name] += rows
            figures.row(f"{case}: {name}", **summary(rows))
    totals = {name: summary(rows) for name, rows in everything.items()}
    for name, total in totals.items():
        figures.row(f"all: {name}", **total)
    return int(totals.get("QpSolver", {"wrong": 0})["wrong"] > 0)


if __name__ == "__main__":
    sys.exit(main())

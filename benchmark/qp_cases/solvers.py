"""Solvers of quadratic programs in one form: prepared for a problem, then timed."""

import ctypes
import math
from typing import Any, NamedTuple

import daqp
import numpy as np
from numba import njit

from solfer.numerics.solvers import active_set
from solfer.numerics.solvers.qp import Problem, QpSolver, QpStatus

SOLVED, INFEASIBLE, UNKNOWN = "solved", "infeasible", "unknown"
PRIMAL, DUAL = 1e-8, 1e-12
"""Tolerances of DAQP. With 1e-9 it calls feasible levels of tasks infeasible, with 1e-7 it misses solutions by more."""
EXACT = 1e-9
"""Tolerance of the others."""


class Stacked(NamedTuple):
    """A problem as DAQP has it: unknowns first, then inequalities and equalities.

    Attributes:
        matrix: C, then A, shape (i + e, n).
        lower: Lower bounds, shape (n + i + e,).
        upper: Upper bounds, shape (n + i + e,).
        sense: 5 for equalities, else 0, shape (n + i + e,).
    """

    matrix: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    sense: np.ndarray


def stacked(problem: Problem) -> Stacked:
    """Stack the constraints of a problem."""
    sides = problem.equality_vector
    lower = np.concatenate((problem.x_min, problem.lower, sides))
    upper = np.concatenate((problem.x_max, problem.upper, sides))
    sense = np.zeros(len(lower), dtype=np.intc)
    sense[len(lower) - len(sides) :] = 5
    matrix = np.vstack((problem.inequality_matrix, problem.equality_matrix))
    return Stacked(matrix, np.maximum(lower, -1e30), np.minimum(upper, 1e30), sense=sense)


class Ours:
    """`QpSolver`."""

    def __init__(self, problem: Problem):
        self._solver = QpSolver(len(problem.gradient), len(problem.equality_vector), len(problem.lower))
        self._solver.problem = problem

    def solve(self) -> Any:
        """Solve the problem."""
        return self._solver.solve()

    def outcome(self, result: Any) -> tuple[str, np.ndarray]:
        """Return the outcome of a solution, and x."""
        known = {QpStatus.SOLVED: SOLVED, QpStatus.INFEASIBLE: INFEASIBLE}
        return known.get(result.status, UNKNOWN), result.x


_compiled = active_set.solve


@njit
def _ours(*given):
    return _compiled(*given)


class OursCompiled(Ours):
    """The kernel of `QpSolver`, called from compiled code."""

    def __init__(self, problem: Problem):
        super().__init__(problem)
        self._x = np.zeros(len(problem.gradient))
        self._given = problem.arrays(), EXACT, self._solver._space, self._x

    def solve(self) -> Any:  # noqa: D102 see Ours
        return _ours(*self._given)

    def outcome(self, result: Any) -> tuple[str, np.ndarray]:  # noqa: D102 see Ours
        return (SOLVED, INFEASIBLE, UNKNOWN, UNKNOWN, UNKNOWN)[result[0]], self._x


class Daqp:
    """`daqp.solve`."""

    def __init__(self, problem: Problem):
        self._given = (problem.hessian, problem.gradient, *stacked(problem))
        self._given = (*self._given[:3], self._given[4], self._given[3], self._given[5])

    def solve(self) -> Any:  # noqa: D102 see Ours
        return daqp.solve(*self._given, primal_tol=PRIMAL, dual_tol=DUAL)

    def outcome(self, result: Any) -> tuple[str, np.ndarray]:  # noqa: D102 see Ours
        return {1: SOLVED, -1: INFEASIBLE}.get(result[2], UNKNOWN), np.array(result[0])


class DaqpModel(Daqp):
    """`daqp.Model`, which keeps its memory, with all of the problem updated."""

    def __init__(self, problem: Problem):
        super().__init__(problem)
        self._model = daqp.Model()
        self._model.setup(*self._given)
        self._model.settings = {"primal_tol": PRIMAL, "dual_tol": DUAL}

    def solve(self) -> Any:  # noqa: D102 see Ours
        hessian, gradient, matrix, upper, lower, sense = self._given
        rows = {"A": matrix} if len(matrix) else {}  # 0.11 cannot update a matrix without rows
        self._model.update(H=hessian, f=gradient, bupper=upper, blower=lower, sense=sense, **rows)
        return self._model.solve()


class _CProblem(ctypes.Structure):
    """`DAQPProblem` of DAQP 0.11."""

    _fields_ = (
        *((name, ctypes.c_int) for name in ("n", "m", "ms")),
        *((name, ctypes.c_void_p) for name in ("H", "f", "A", "bupper", "blower", "sense", "break_points")),
        *((name, ctypes.c_int) for name in ("nh", "problem_type")),
    )


class _CResult(ctypes.Structure):
    """`DAQPResult` of DAQP 0.11."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("x", "lam")),
        *((name, ctypes.c_double) for name in ("fval", "soft_slack")),
        *((name, ctypes.c_int) for name in ("exitflag", "iter", "nodes")),
        *((name, ctypes.c_double) for name in ("solve_time", "setup_time")),
    )


class _CSettings(ctypes.Structure):
    """First settings of DAQP 0.11; the rest is left as it is."""

    _fields_ = (("primal_tol", ctypes.c_double), ("dual_tol", ctypes.c_double), ("others", ctypes.c_byte * 496))


_library = ctypes.CDLL(daqp.__file__)
_setup = _library.setup_daqp_main
_setup.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
_update = _library.daqp_update_ldp
_update.argtypes = (ctypes.c_int, ctypes.c_size_t, ctypes.c_size_t)
_solve = _library.daqp_solve
_solve.argtypes = (ctypes.c_size_t, ctypes.c_size_t)
_solve.restype = None
_SETTINGS = 28
"""Place of the pointer to the settings in the workspace, in pointers."""
_EVERYTHING = 1 + 2 + 4 + 8 + 16
_UNLESS_FREE = 64
_ELIMINATE = 128
"""Masks of an update: all arrays; nothing more where no constraint counts; with equalities eliminated."""


@njit
def _daqp(mask, problem, work, result):
    flag = _update(mask, work, problem)
    if flag >= 0:
        _solve(result, work)
    return flag


class DaqpC(Daqp):
    """DAQP's interface in C with memory that is kept, called from compiled code."""

    mask = _EVERYTHING + _UNLESS_FREE

    def __init__(self, problem: Problem):
        super().__init__(problem)
        hessian, gradient, matrix, upper, lower, sense = self._given
        size, rows = len(gradient), len(upper)
        self._x, self._multipliers = np.zeros(size), np.zeros(rows)
        pointers = [each.ctypes.data for each in (hessian, gradient, matrix, upper, lower, sense)]
        self._problem = _CProblem(size, rows, size, *pointers, None, 0, 0)
        self._result = _CResult(self._x.ctypes.data, self._multipliers.ctypes.data)
        self._settings = _CSettings()
        _library.daqp_default_settings(ctypes.byref(self._settings))
        self._settings.primal_tol, self._settings.dual_tol = PRIMAL, DUAL
        self._work = (ctypes.c_void_p * 256)()
        self._work[_SETTINGS] = ctypes.addressof(self._settings)
        # an easy problem first: setup frees its memory where it finds a contradiction
        easy = np.full(rows, 1e30)
        none = np.zeros(rows, dtype=np.intc)
        least = -easy
        simple = _CProblem(size, rows, size, *pointers[:3], easy.ctypes.data, least.ctypes.data, none.ctypes.data)
        self.flag = _setup(ctypes.byref(simple), self._work, None, 0)
        self._addresses = tuple(ctypes.addressof(each) for each in (self._problem, self._work, self._result))

    def solve(self) -> Any:  # noqa: D102 see Ours
        return _daqp(self.mask, *self._addresses)

    def outcome(self, result: Any) -> tuple[str, np.ndarray]:  # noqa: D102 see Ours
        flag = self._result.exitflag if result >= 0 else result
        return {1: SOLVED, -1: INFEASIBLE}.get(flag, UNKNOWN), self._x


class DaqpEliminated(DaqpC):
    """The same with equalities eliminated."""

    mask = DaqpC.mask + _ELIMINATE


class Quadprog:
    """quadprog: the method of Goldfarb and Idnani in C."""

    def __init__(self, problem: Problem):
        whole = stacked(problem)
        rows = np.vstack((np.eye(len(problem.gradient)), whole.matrix))
        is_equality = whole.sense > 0
        above = (whole.lower > -1e30) & ~is_equality
        below = (whole.upper < 1e30) & ~is_equality
        matrix = np.vstack((rows[is_equality], rows[above], -rows[below]))
        sides = np.concatenate((whole.lower[is_equality], whole.lower[above], -whole.upper[below]))
        self._given = problem.hessian, -problem.gradient, matrix.T.copy(), sides, int(is_equality.sum())

    def solve(self) -> Any:  # noqa: D102 see Ours
        import quadprog

        try:
            return quadprog.solve_qp(*self._given)[0]
        except ValueError as error:
            return str(error)

    def outcome(self, result: Any) -> tuple[str, np.ndarray]:  # noqa: D102 see Ours
        if isinstance(result, str):
            return INFEASIBLE if "inconsistent" in result else UNKNOWN, np.full(len(self._given[1]), math.nan)
        return SOLVED, result


class Proxqp:
    """ProxQP, dense, which starts anew."""

    def __init__(self, problem: Problem):
        from proxsuite import proxqp

        self._status = proxqp.QPSolverOutput
        size, equalities = len(problem.gradient), len(problem.equality_vector)
        self._solver = proxqp.dense.QP(size, equalities, len(problem.lower), True)
        self._solver.settings.eps_abs = EXACT
        self._solver.settings.initial_guess = proxqp.NO_INITIAL_GUESS
        self._given = {
            "H": problem.hessian,
            "g": problem.gradient,
            "A": problem.equality_matrix,
            "b": problem.equality_vector,
            "C": problem.inequality_matrix,
            "l": np.maximum(problem.lower, -1e20),
            "u": np.minimum(problem.upper, 1e20),
            "l_box": np.maximum(problem.x_min, -1e20),
            "u_box": np.minimum(problem.x_max, 1e20),
        }
        self._solver.init(**self._given)

    def solve(self) -> Any:  # noqa: D102 see Ours
        self._solver.update(**self._given)
        self._solver.solve()
        return self._solver.results

    def outcome(self, result: Any) -> tuple[str, np.ndarray]:  # noqa: D102 see Ours
        known = {self._status.PROXQP_SOLVED: SOLVED, self._status.PROXQP_PRIMAL_INFEASIBLE: INFEASIBLE}
        return known.get(result.info.status, UNKNOWN), np.array(result.x)

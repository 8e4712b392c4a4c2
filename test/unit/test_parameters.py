"""Functions take at most seven parameters, as ruff checks, and calls name what they pass from the sixth on."""

import ast
import re
from pathlib import Path

PACKAGES = Path(__file__).resolve().parents[2] / "src"

MANY = {
    "solfer/config/loading/load.py",
    "solfer/plugins/generation/check.py",
    "solfer/points/contact/contacts.py",
    "solfer/recording/log.py",
    "solfer/tasks/task.py",
}
"""Files with one function of more parameters, for users, as stands beside it; there are five at most."""

COMPILED = re.compile(r"kernel|/compiled/|/numerics/|inverse_dynamics/watch")
"""Paths of compiled functions, which numba calls by position."""

POSITIONAL = 6
"""Positional arguments from which on a call has too many."""

KERNELS = {
    "approach",
    "count_kept",
    "gather",
    "limit_square",
    "objective",
    "self._check",
    "self._receive",
    "self._shift",
}
"""Compiled functions by the names under which they are called."""

FOREIGN = re.compile(
    r"^(self\._)?(bullet|lapack|struct)\.|\bmujoco\.mj_|(\.|^)(warning|info|error|exception|debug)$|kernel\."
)
"""Calls of others: of engines and LAPACK, which have no names, of `struct`, of loggers, of kernels by module."""


def test_functions_with_more_parameters_are_few():
    texts = {path.relative_to(PACKAGES).as_posix(): path.read_text() for path in PACKAGES.rglob("*.py")}
    marked = {
        name: re.findall(r"# noqa: PLR09\d\d(?:, PLR09\d\d)*(?: (for users))?", text) for name, text in texts.items()
    }
    assert {name: marks for name, marks in marked.items() if marks} == dict.fromkeys(MANY, ["for users"])


def calls(text):
    """Yield the name of what is called with too many positional arguments, and the line."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call):
            given = [each for each in node.args if not isinstance(each, ast.Starred)]
            if len(given) >= POSITIONAL:
                yield ast.unparse(node.func), node.lineno


def test_calls_name_their_arguments():
    found = {
        (name, f"{path.relative_to(PACKAGES)}:{line}")
        for path in sorted(PACKAGES.rglob("*.py"))
        if not COMPILED.search(path.as_posix())
        for name, line in calls(path.read_text())
        if not FOREIGN.search(name)
    }
    assert [place for name, place in sorted(found) if name not in KERNELS] == []
    assert {name for name, _ in found} == KERNELS  # what is called no more leaves the list

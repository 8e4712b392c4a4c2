"""Functions take at most seven parameters, as ruff checks, and calls name what they pass from the sixth on."""

import ast
import re
from pathlib import Path

PACKAGES = Path(__file__).resolve().parents[2] / "src"

MANY = {
    "solfer/config/loading/load.py": "for users",
    "solfer/plugins/generation/check.py": "for users",
    "solfer/points/contact/contacts.py": "for users",
    "solfer/recording/log.py": "for users",
    "solfer/tasks/task.py": "for users",
}
"""Files with a function of more parameters, each with the reason that stands beside it; there are five at most."""

COMPILED = re.compile(r"kernel|/compiled/|/numerics/|inverse_dynamics/watch")
"""Paths of compiled functions, which numba calls by position."""

POSITIONAL = 6
"""Positional arguments from which on a call has too many."""

KERNELS = {
    "advance",
    "approach",
    "bear",
    "carry",
    "count_kept",
    "descend",
    "gather",
    "objective",
    "self._check",
    "self._find",
    "self._shift",
}
"""Compiled functions by the names under which they are called."""

FOREIGN = re.compile(r"^(self\._)?(bullet|lapack|struct)\.|(\.|^)(warning|info|error|exception|debug)$|kernel\.")
"""Calls of others: of PyBullet and LAPACK, which have no names, of `struct`, of loggers, and of kernels by module."""


def test_functions_with_more_parameters_are_few():
    marked = {
        path.relative_to(PACKAGES).as_posix(): re.findall(
            r"# noqa: PLR0913(?:, PLR0917)? (for users)", path.read_text()
        )
        for path in PACKAGES.rglob("*.py")
        if "PLR09" in path.read_text()
    }
    assert marked == {name: [reason] for name, reason in MANY.items()} and len(MANY) <= 5


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


def test_only_positional_arguments_are_counted():
    assert list(calls("f(1, 2, 3, 4, 5, six=6, *more)\ng(1, 2, 3, 4, 5, 6)\n")) == [("g", 2)]

"""One assignment a line: values that do not belong together are not packed into one assignment."""

import ast
from pathlib import Path

PACKAGES = Path(__file__).resolve().parents[2] / "src"
MOST = 0.03
"""Share of assignments that may pack values: those that depend on each other, and constants with one description."""


def packed(text):
    """Count the assignments of a module's text, and those of several values to several names."""
    assignments = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Assign)]
    several = [
        each for each in assignments if isinstance(each.targets[0], ast.Tuple) and isinstance(each.value, ast.Tuple)
    ]
    return len(assignments), len(several)


def test_assignments_pack_no_values():
    counts = [packed(path.read_text()) for path in sorted(PACKAGES.rglob("*.py"))]
    assignments, several = (sum(column) for column in zip(*counts, strict=True))
    assert assignments > 10_000 and 0 < several < MOST * assignments

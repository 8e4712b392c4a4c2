"""A constant's name has one meaning in the whole code: modules that give it different values name it apart."""

import ast
from collections import defaultdict
from pathlib import Path

SOURCE = Path(__file__).parents[2] / "src/solfer"

TABLES = {"CONTENT", "RECORDS", "_HOMES"}
"""What each kind of pipe, and each package, has by the same name, for what looks there."""


def constants(path: Path) -> dict[str, str]:
    """Return the constants of a module with their values, as they are written."""
    found = {}
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            target, value = node.targets[0], node.value
            pairs = [(target, value)]
            if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
                pairs = list(zip(target.elts, value.elts, strict=False))
            found |= {
                each.id: ast.unparse(one) for each, one in pairs if isinstance(each, ast.Name) and each.id.isupper()
            }
    return found


def meanings(root: Path) -> dict[str, dict[str, str]]:
    """Return the constants with several values, and these by module."""
    values = defaultdict(dict)
    for path in sorted(root.rglob("*.py")):
        for name, value in constants(path).items():
            values[name][str(path.relative_to(root))] = value
    return {name: each for name, each in values.items() if len(set(each.values())) > 1}


def test_no_constant_has_two_meanings():
    assert {name: each for name, each in meanings(SOURCE).items() if name not in TABLES} == {}


def test_two_meanings_are_found(tmp_path):
    (tmp_path / "one.py").write_text("PATIENCE, RATE = 1.0, 2.0\n")
    (tmp_path / "two.py").write_text("PATIENCE = 3.0\nRATE = 2.0\n")
    assert meanings(tmp_path) == {"PATIENCE": {"one.py": "1.0", "two.py": "3.0"}}

"""Classes have at most fifteen attributes: what belongs together is an object with a name."""

import ast
from pathlib import Path

PACKAGES = Path(__file__).resolve().parents[2] / "src"

MOST = 15
"""Attributes that a class may assign to itself. Records of tags and compiled functions assign none."""

MORE = {
    "Component": 16,
    "Kinematics": 26,
    "Robot": 23,
    "Simulation": 23,
}
"""Classes that have more, with how many: their attributes are their interface, which components and plugins read.
`Kinematics` and `Robot` make copies that share part of them (`twin`, `companion`)."""


def attributes(text):
    """Return the number of attributes that each class of a module's text assigns to itself, by its name."""
    return {
        each.name: len(
            {
                node.attr
                for node in ast.walk(each)
                if isinstance(node, ast.Attribute)
                and isinstance(node.ctx, ast.Store)
                and isinstance(node.value, ast.Name)
                and node.value.id == "self"
            }
        )
        for each in ast.walk(ast.parse(text))
        if isinstance(each, ast.ClassDef)
    }


def test_classes_have_few_attributes():
    counts = {}
    for path in sorted(PACKAGES.rglob("*.py")):
        counts |= {name: count for name, count in attributes(path.read_text()).items() if count > MOST}
    assert counts == MORE

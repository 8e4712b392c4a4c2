"""Names: no public class has the name of another one."""

import ast
from collections import defaultdict
from importlib import import_module
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGES = REPOSITORY / "src"


def public_classes(folder: Path) -> dict[str, list[str]]:
    """Files that define a public class, by its name."""
    files = defaultdict(list)
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                files[node.name].append(str(path.relative_to(folder)))
    return files


@pytest.mark.slow
def test_no_public_class_name_twice():
    assert {name: files for name, files in public_classes(PACKAGES).items() if len(files) > 1} == {}


def test_same_name_in_two_files_is_found(tmp_path):
    for name in ("one.py", "two.py"):
        (tmp_path / name).write_text("class Pipe:\n    class _Part:\n        pass\n")
    assert public_classes(tmp_path) == {"Pipe": ["one.py", "two.py"]}


@pytest.mark.parametrize("package", ["solfer", "solfer.model", "solfer.points", "solfer.tasks"])
def test_a_missing_name_is_no_attribute(package):
    """Their names are imported when they are first used; `hasattr` and `import` need this error."""
    name = "Handlre"
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute '{name}'"):
        getattr(import_module(package), name)

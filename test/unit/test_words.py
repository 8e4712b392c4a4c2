"""Names, docstrings and messages of the code use the field's words: publish, receive, measure, report, desired."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

SOURCE = Path(__file__).parents[2] / "src"

NOWHERE = re.compile(r"\b(?:told|tells?|hears?|heard|wanted|anew|nobody|somebody|someone|whoever)\b", re.IGNORECASE)
"""In no name, docstring or text."""

NOT_FIRST = re.compile(r"\b(?:ways?|who|asks?|asked|says?|said)\b", re.IGNORECASE)
"""In no name, and in no first line of a docstring."""

OF_OTHERS = {"tell", "ask"}
"""Methods of files and of Optuna."""

CHANNEL = "wanted"
"""Part of the names of channels in recordings, which users have."""


def words(name: str) -> str:
    """Return the words of a name, apart."""
    return " ".join(re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name))


def names(tree: ast.AST) -> Iterator[str]:
    """Yield all names that a module uses or makes."""
    for node in ast.walk(tree):
        for field in ("id", "attr", "arg", "name"):
            name = getattr(node, field, None)
            if isinstance(name, str):
                yield name


def docstrings(tree: ast.AST) -> Iterator[str]:
    """Yield all docstrings."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield ast.get_docstring(node) or ""


def texts(tree: ast.AST) -> Iterator[str]:
    """Yield all texts, docstrings among them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def wrong(path: Path) -> list[str]:
    """List what a module should say differently."""
    tree = ast.parse(path.read_text())
    found = [name for name in names(tree) if name not in OF_OTHERS and NOWHERE.search(words(name))]
    found += [name for name in names(tree) if name not in OF_OTHERS and NOT_FIRST.search(words(name))]
    found += [text for text in texts(tree) if text != CHANNEL and NOWHERE.search(text)]
    return found + [text for text in docstrings(tree) if NOT_FIRST.search(text.partition("\n")[0])]


def test_the_code_uses_the_fields_words():
    found = {str(path): each for path in sorted(SOURCE.rglob("*.py")) if (each := wrong(path))}
    assert found == {}


def test_words_of_people_are_found(tmp_path):
    file = tmp_path / "module.py"
    file.write_text('"""Who asks."""\n\n\ndef heard_of(way):\n    """Say it."""\n    return "told anew"\n')
    assert wrong(file) == ["heard_of", "way", "told anew", "Who asks.", "Say it."]

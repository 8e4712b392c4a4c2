"""Errors say what would have been right: each place that makes one gives `expected`, or the names that there are."""

import ast
from pathlib import Path

import pytest

import solfer.errors
from solfer.errors import SolferError

PACKAGES = Path(__file__).resolve().parents[2] / "src"
ERRORS = {
    name for name, each in vars(solfer.errors).items() if isinstance(each, type) and issubclass(each, SolferError)
}
SAID = {"UnknownName", "NotFinite", "SizeMismatch", "SolferErrors"}
"""Errors whose kind, or whose text with both sizes, says it."""

PASSED_ON = {"message", "refusal", "reason"}
"""Texts of another error, which says itself what was expected."""


def silent(tree):
    """List the lines of a module that make an error without a word of what was expected."""
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in ERRORS - SAID
        and not {"expected", "names", None} & {keyword.arg for keyword in node.keywords}
        and not any(passed_on(each) for each in node.args)
    ]


def passed_on(argument):
    """Return whether a text has what another error said in it."""
    return any(
        (isinstance(node, ast.Attribute) and node.attr in PASSED_ON)
        or (isinstance(node, ast.Name) and node.id in (*PASSED_ON, "located", "described"))
        for node in ast.walk(argument)
    )


@pytest.mark.slow
def test_errors_say_what_was_expected():
    files = sorted(PACKAGES.rglob("*.py"))
    found = {str(path.relative_to(PACKAGES)): silent(ast.parse(path.read_text())) for path in files}
    assert files and {path: lines for path, lines in found.items() if lines} == {}


def test_silent_errors_are_found():
    texts = (
        "ConfigError('x')",
        "ConfigError('x', where='y')",
        "MiddlewareError(f'no: {error}')",
        "ConfigError('x', expected='y')",
        "MiddlewareError(f'no: {answer.message}')",
        "MiddlewareError(f'no: {described(error)}')",
        "UnknownName('joint', 'a', ())",
        "ValueError('x')",
    )
    assert silent(ast.parse("\n".join(texts))) == [1, 2, 3]

"""What pages cite as proof exists, and runs every day unless a line of the page says that it is a soak."""

import ast
import re

import pytest

CITED = re.compile(r"\b((?:test/(?:unit|integration|ros)|benchmark)/[a-z0-9_/]+\.py)|`(test_\w+|\w+_test)`")
WRITTEN_BY_READERS = ("how-to/extend/", "tutorials/first_component.md")
"""Pages with files that their reader writes; `test_recipes` checks those of the recipes."""


@pytest.fixture(scope="module")
def cited(repository):
    """Return the files that pages cite, each with the line; a bare name counts where a file of tests has it."""
    files = {path.stem: path for path in (repository / "test").rglob("*.py") if path.parts[-2] != "support"}
    found = []
    for page in (repository / "CONTRIBUTING.md", *sorted((repository / "docs").rglob("*.md"))):
        if any(part in page.as_posix() for part in WRITTEN_BY_READERS):
            continue
        for line in page.read_text().splitlines():
            paths = [repository / path if path else files.get(name) for path, name in CITED.findall(line)]
            found += [(path, line, page.name) for path in paths if path]
    return found


def is_daily(node):
    """Return whether a function is a test without the mark `soak`, or a class has such a test or inherits its tests."""
    if any(ast.unparse(mark) in ("soak", "pytest.mark.soak") for mark in getattr(node, "decorator_list", ())):
        return False
    if isinstance(node, ast.ClassDef):
        tests = [part for part in node.body if getattr(part, "name", "").startswith("test_")]
        return "Test" in node.name and (any(map(is_daily, tests)) if tests else bool(node.bases))
    return isinstance(node, ast.FunctionDef) and node.name.startswith("test_")


def runs_daily(path):
    """Return whether a file has a test that runs every day; one of a rostest needs a launch that does, too."""
    body = ast.parse(path.read_text()).body
    if any(isinstance(node, ast.Assign) and re.match(r"pytestmark = .*\bsoak\b", ast.unparse(node)) for node in body):
        return False
    if path.name.endswith("_test.py"):
        soaks = re.search(r"^SOAK = (.*)$", (path.parent / "test_rostests.py").read_text(), re.MULTILINE)
        starts = re.compile(rf'type="{path.stem}\.py"|args="[^"]*\b{path.stem.removesuffix("_test")}\b')
        launches = [launch.stem for launch in path.parent.glob("*.test") if starts.search(launch.read_text())]
        if set(launches) <= set(ast.literal_eval(soaks[1])):
            return False
    return any(map(is_daily, body))


def test_cited_files_exist(cited):
    assert len(cited) > 80 and [(path.name, page) for path, _, page in cited if not path.is_file()] == []


def test_cited_tests_run_every_day_or_are_named_a_soak(cited):
    named = {(path, page) for path, line, page in cited if "soak" in line}
    tests = {(path, page) for path, _, page in cited if re.search(r"^test_|_test$", path.stem) and path.is_file()}
    assert sorted((path.name, page) for path, page in tests - named if not runs_daily(path)) == []


@pytest.mark.parametrize(
    ("text", "daily"),
    [
        ("@pytest.mark.soak\ndef test_a(): pass\n", False),
        ("pytestmark = [pytest.mark.soak]\ndef test_a(): pass\n", False),
        ("@soak\nclass ATest(TestCase):\n  def test_a(self): pass\n", False),
        ("def helper(): pass\n", False),
        ("@pytest.mark.soak\ndef test_a(): pass\ndef test_b(): pass\n", True),
        ("class TestA(Rows):\n  pass\n", True),
    ],
)
def test_a_file_of_soaks_alone_is_noticed(tmp_path, text, daily):
    path = tmp_path / "test_file.py"
    path.write_text(text)
    assert runs_daily(path) == daily

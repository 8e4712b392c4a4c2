"""`benchmark/mutations.py` on a package of a few lines: what is drawn, what is killed, and that it goes on."""

import json

import pytest
from support.estimation import part

AREA = '''"""Areas."""

import logging

log = logging.getLogger(__name__)


def area(width: int | None, height: int) -> int:
    """Return 3 + 4."""
    if height < -(9):
        raise ValueError(f"{height + 1} is too small: " + str(height - 2))
    log.info("an area of %d", width * 5)
    return width * height


def unused(value):
    return value + 1


class Shape:
    def __repr__(self):
        return "x" * 3
'''
TEST = """from toy.shapes.area import area


def test_area():
    assert area(3, 5) == 15
"""


@pytest.fixture
def mutations():
    return part("mutations")


@pytest.fixture
def tree(tmp_path):
    """Make a checkout of a package with one room, and a room that imports it."""
    files = {"src/toy/__init__.py": "", "src/toy/shapes/__init__.py": "", "src/toy/shapes/area.py": AREA}
    files |= {"src/toy/rooms/__init__.py": "", "src/toy/rooms/room.py": "from toy.shapes.area import unused\n"}
    files |= {"test/unit/shapes/test_area.py": TEST, "pytest.ini": "[pytest]\naddopts = --import-mode=importlib\n"}
    files["test/unit/rooms/test_room.py"] = "def test_nothing():\n    pass\n\n\ndef test_broken():\n    assert False\n"
    for name, text in files.items():
        path = tmp_path / "tree" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "tree"


def change(mutations, old, new):
    """Return a mutation of one line."""
    line = AREA.split("\n").index(old) + 1
    return mutations.Mutation("src/toy/shapes/area.py", "By_Hand", line, (old,), (new,))


@pytest.mark.slow
def test_only_behaviour_is_mutated(mutations, tree):
    """Docstrings, annotations, errors, logs and `__repr__` stay; all else is drawn sooner or later, by the seed."""
    sources = mutations.Sources(tree)
    drawn = mutations.draw(sources, ["shapes"], 60, 3)
    assert drawn == mutations.draw(sources, ["shapes"], 60, 3)
    lines = {mutation.old for mutation in drawn}
    bodies = {"    if height < -(9):", "    return width * height", "    return value + 1"}
    assert lines == {(body,) for body in bodies} and len(drawn) > 20
    assert sources.importing("shapes") == ["rooms"]


@pytest.mark.slow
def test_a_mutation_is_killed_or_survives(mutations, tree, tmp_path):
    """What a test notices is killed by its name, what none notices survives; a result is not run again.

    A test that fails anyway kills nothing. The checkout stays as it is, also where its lines are others.
    """
    copy, results = mutations.Copy(tree, tmp_path / "copy"), tmp_path / "results.jsonl"
    killed = change(mutations, "    return width * height", "    return width + height")
    survivor = change(mutations, "    return value + 1", "    return value - 1")
    absent = survivor._replace(old=("    return value + 2",))
    mutations.run(copy, [killed], results, 60.0)
    mutations.run(copy, [killed, survivor, absent], results, 60.0)
    states = [(each["state"], each["test"]) for each in mutations.read_results(results)]
    assert states == [("killed", "test/unit/shapes/test_area.py::test_area"), ("survived", ""), ("absent", "")]
    written = results.read_text()
    mutations.run(copy, [killed, survivor, absent], results, 60.0)
    assert results.read_text() == written
    assert (tree / killed.file).read_text() == (copy.folder / killed.file).read_text() == AREA
    table = list(mutations.report(mutations.read_results(results), mutations.Sources(tree)))
    assert "| `shapes` | 2 | 1 | 0 | 1 | 50 % |" in table and any("+    return value - 1" in line for line in table)


@pytest.mark.soak
@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "state"), [("while True: pass", "timed out"), ('__import__("os").abort()', "crashed")]
)
def test_what_ends_no_test_is_noticed(mutations, tree, tmp_path, line, state):
    copy, results = mutations.Copy(tree, tmp_path / "copy"), tmp_path / "results.jsonl"
    mutation = change(mutations, "    return width * height", f"    {line}")
    mutations.run(copy, [mutation], results, 4.0)
    assert json.loads(results.read_text())["state"] == state

"""The examples of references: those of the pages, and the files of `config/references`."""

import re

import pytest

from solfer import Robot
from solfer.components.inverse_kinematics import InverseKinematics
from solfer.config import read
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins.generation.check import check_file
from solfer_tools.navigation import ReferenceCourse, read_references

SECTION = re.compile(r"^#+ References(?: without a program)?\n(.*?)(?=^#+ )", re.MULTILINE | re.DOTALL)
BLOCK = re.compile(r"^```yaml\n(.*?)^```", re.MULTILINE | re.DOTALL)


@pytest.fixture
def example(repository):
    """Return the YAML of a page's section on references."""

    def example(page):
        sections = SECTION.findall((repository / "docs" / page).read_text() + "\n# \n")
        (block,) = [block for section in sections for block in BLOCK.findall(section)]
        return block

    return example


@pytest.fixture
def beside(repository, tmp_path):
    (tmp_path / "references").symlink_to(repository / "config/references")
    (tmp_path / "eight.csv").symlink_to(repository / "config/references/eight.csv")
    return tmp_path


def played(file):
    """Make the course of a file of references, and return how long it takes [s]."""
    return ReferenceCourse(MemoryMiddleware(Bus(), "navigation"), read_references(file), "hands").left


def test_the_stack_of_the_page_is_made(repository, beside, example):
    text = example("reference/inverse_kinematics.md")
    levels = "  levels: [[com], [left, right, posture]]\n"
    file = beside / "stack.yaml"
    file.write_text("hands:\n stack:\n" + re.sub("^", "  ", text.rstrip(), flags=re.MULTILINE) + "\n" + levels)
    folder = repository / "config/robots/centauro"
    robot = Robot.load(folder / "centauro.urdf", folder / "centauro.srdf")
    robot.update()
    component = InverseKinematics(robot, read(file, InverseKinematics.Tags, ("hands",)), "hands")
    assert list(component.references.targets) == ["left", "right", "com"] and len(component.references._postures) == 1


def test_the_references_of_the_page_are_made(beside, example):
    file = beside / "references.yaml"
    file.write_text(example("reference/navigation.md"))
    assert played(file) == 9.0


@pytest.mark.parametrize(("name", "duration"), [("hands", 9.0), ("nod", 4.5)])
def test_shipped_references_are_made(repository, name, duration):
    assert played(repository / f"config/references/{name}.yaml") == duration


@pytest.mark.slow
def test_a_reference_that_is_too_fast_is_one_error_of_the_check(repository, beside):
    """`solfer check` names file, line and column of the reference, and what the motion of the task allows."""
    config = repository / "config"
    for path in config.iterdir():
        if path.name not in ("centauro.yaml", "references"):
            (beside / path.name).symlink_to(path)
    text = (config / "centauro.yaml").read_text()
    assert text.count("radius: 0.05, period: 4.0") == 1
    file = beside / "centauro.yaml"
    file.write_text(text.replace("radius: 0.05, period: 4.0", "radius: 0.5, period: 1.0"))
    line = text[: text.index("radius: 0.05")].count("\n") + 1
    (error,) = check_file(file, ["drawing"]).errors
    assert error.where.startswith(f"{file}:{line}:33: ") and error.where.endswith("tasks.left.reference.circle")
    assert error.what == "a speed of 3.142 m/s" and "at most 1 m/s" in error.expected

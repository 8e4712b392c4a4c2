"""The recipes of docs/how-to/extend fit the code."""

import re
from contextlib import closing

import numpy as np
import pytest
from support.needs import pybullet_robot

from solfer import Robot
from solfer.points import LinearPoint
from solfer.simulation import Simulation, read_bundle


@pytest.fixture(scope="module")
def page(repository):
    """Read the recipes, and what leads to them."""
    recipes = sorted((repository / "docs/how-to/extend").glob("*.md"))
    return "".join(path.read_text() for path in (repository / "CONTRIBUTING.md", *recipes))


def rows(page):
    """Paths of a recipe's table, and what is to be done with them."""
    return re.findall(r"^\| (`(?:src|test|docs|config)/.*?) \| (new|change|written)", page, re.MULTILINE)


def test_files_to_change_exist_and_new_ones_do_not(page, repository):
    wrong = [
        name
        for names, what in rows(page)
        for name in re.findall(r"`([^`]+)`", names)
        if (repository / name).exists() == (what == "new")
    ]
    assert rows(page) and wrong == []


def test_files_in_the_text_exist(page, repository):
    text = re.sub(r"^\|.*$", "", page, flags=re.MULTILINE)
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    named = re.findall(r"`((?:src|test|docs|msg|nodes)/[\w./]*)`", text)
    new = {"test/unit/pipes/test_added.py"}
    assert {name for name in named if not (repository / name).exists()} == new


def test_code_compiles(page):
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert len(blocks) >= 10
    for block in blocks:
        compile(block, "a recipe", "exec")


def classes(page, name):
    """Return the block that defines a class."""
    (block,) = (block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if f"\nclass {name}(" in block)
    held = {"__name__": f"recipe_{name.lower()}"}
    exec(compile(block, "a recipe", "exec"), held)
    return held


@pytest.mark.parametrize("name", ["AddedControllerRecord", "AddedCommandPipe", "Nod", "WallClockMiddleware", "Tracker"])
def test_classes_of_the_recipes_can_be_defined(page, name):
    assert name in classes(page, name)


def test_midpoint_lies_in_the_middle(page, repository):
    folder = repository / "config/robots/centauro"
    robot = Robot.load(folder / "centauro.urdf", folder / "centauro.srdf")
    robot.update()
    hands = [LinearPoint(link, robot) for link in ("arm1_7", "arm2_7")]
    middle = classes(page, "Midpoint")["Midpoint"](hands)
    for point in (*hands, middle):
        point.update()
    np.testing.assert_allclose(middle.value, 0.5 * (hands[0].value + hands[1].value))
    np.testing.assert_allclose(middle.jacobian, 0.5 * (hands[0].jacobian + hands[1].jacobian))


def test_tracker_measures_where_its_link_is(page):
    held = classes(page, "Tracker")
    with closing(Simulation.from_file(read_bundle(pybullet_robot("kuka_iiwa/model.urdf")))) as simulation:
        tracker = held["Tracker"](simulation.state, held["TrackerRecord"](link="lbr_iiwa_link_7", noise=0.01), 3)
        simulation.step()
        simulation.kinematics.update(simulation.q)
        away = tracker.measure().values - simulation.kinematics.position("lbr_iiwa_link_7")
        assert tracker.topics == ("tracker",) and 0.0 < np.abs(away).max() < 0.06

"""Stacks of tasks with the original program's tags: what they do, and mistakes in them."""

import logging
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import centauro
from support.unit.refusals import place_of

from solfer.config import read
from solfer.config.tasks.original import OriginalStackTags, hands, translated
from solfer.config.tasks.stack import TaskRecord
from solfer.errors import SolferError
from solfer.tasks import Hierarchy, build_stack

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
PERIOD = 0.005  # [s]

TAGS = """
hands:
  chain: upper_body
  track: manipulation
  workspace_init: arm_base
  reference: pelvis
  IK: [qp::ARMS]
  tunning: disturb
  tunnings:
    disturb: {ratio: 1.0, damping: 0.0001, ARMS: 0.5}
    slow: {damping: 0.01, ARMS: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], ARMS_DAMP: 0.04}
"""


@pytest.fixture
def robot():
    return centauro("home")


def tags_of(tmp_path, text) -> OriginalStackTags:
    file = tmp_path / "hands.yaml"
    file.write_text(text)
    return read(file, OriginalStackTags, ("hands",))


@pytest.fixture
def build(robot, tmp_path):
    def build(text):
        return build_stack(hands(tags_of(tmp_path, text)), robot)

    return build


def rows_of(stack):
    """Jacobian, errors and gains of all tasks."""
    tasks = stack.tasks.values()
    for task in tasks:
        for point in (*task.point.parts, task.point, task.error):
            point.update()
    jacobian = np.vstack([task.point.jacobian * task.mask for task in tasks])
    return jacobian, np.concatenate([task.error.value for task in tasks])


def test_the_qp_is_that_of_the_original(robot, build):
    stack = build(TAGS)
    solver = stack.solver(PERIOD)
    for reference in stack.references.values():
        reference.set(reference.value + (0.0, -0.05, 0.1))
    velocity = solver.update()
    jacobian, error = rows_of(stack)
    # min 1/2 x'Hx + g'x with H = J'J + d, g = -2 J'Ke
    hessian, gradient = jacobian.T @ jacobian + 1e-4 * np.eye(robot.size), -2.0 * 0.5 * jacobian.T @ error
    assert np.abs(velocity).max() > 0.05
    assert_allclose(velocity, -np.linalg.solve(hessian, gradient), atol=1e-9)
    assert_allclose(velocity[np.setdiff1d(np.arange(robot.size), robot.selectors["upper_body"].indices)], 0.0)


def test_null_spaces_square_the_damping(robot, build):
    stack = build(TAGS.replace("qp::ARMS", "ns::ARMS").replace("tunning: disturb", "tunning: slow"))
    for reference in stack.references.values():
        reference.set(reference.value + (0.0, -0.05, 0.1))
    solver = stack.solver(PERIOD)
    velocity = solver.update()
    jacobian, error = rows_of(stack)
    desired = np.array((0.1, 0.2, 0.3, 0.4, 0.5, 0.6)) * error
    inverse = jacobian.T @ np.linalg.inv(jacobian @ jacobian.T + 0.04**2 * np.eye(6))
    assert isinstance(solver, Hierarchy)
    assert_allclose(velocity, inverse @ desired, atol=1e-9)


@pytest.mark.slow
def test_hands_stay_near_their_bases(robot, build):
    stack = build(TAGS)
    solver = stack.solver(PERIOD)
    for reference in stack.references.values():
        reference.set(reference.value + (2.0, 0.0, 0.0))
    for _ in range(2000):
        robot.state.position[:] += PERIOD * solver.update()
        robot.update()
    for side in ("1", "2"):
        hand, base = (robot.kinematics.position(f"arm{side}_{number}") for number in (7, 1))
        assert np.sum((hand - base) ** 2) == pytest.approx(0.53, abs=1e-4)


def test_sums_are_levels_of_several_tasks(tmp_path):
    known = {name: TaskRecord(point="center_of_mass") for name in ("BASE", "CASTER", "CAMBER")}
    tuning = "{damping: 1e-6, BASE: 30, CASTER: 10, CAMBER: 15}"
    text = f"hands: {{IK: [qp::BASE, qA::SUPPORT], tunning: t, tunnings: {{t: {tuning}}}}}"
    stack = translated(tags_of(tmp_path, text), known, {"SUPPORT": ("CASTER", "CAMBER")})
    assert stack.levels == (("BASE",), ("CASTER", "CAMBER"))
    assert stack.tasks["CAMBER"].gain == 30.0 and stack.solver == "qp"


def test_a_tag_without_effect_is_reported(build, caplog):
    with caplog.at_level(logging.WARNING):
        build(TAGS)
    assert "10:22: hands.tunnings.disturb.ratio: has no effect" in caplog.text


@pytest.mark.parametrize(
    ("before", "after", "place", "message"),
    [
        ("qp::ARMS", "qp::ARM", "qp::ARM]", "unknown task 'ARM'.*ARMS"),
        ("qp::ARMS", "pq::ARMS", "pq::ARMS", "unknown kind of a task 'pq'.*qp"),
        ("qp::ARMS", "qA::SUM", "qA::SUM", "unknown sum of tasks 'SUM'"),
        ("[qp::ARMS]", "[qp::ARMS, ARMS]", "[qp::ARMS, ARMS]", "null spaces beside"),
        ("tunning: disturb", "tunning: distrub", "distrub", "unknown tuning 'distrub'.*disturb"),
        ("ARMS: 0.5", "ARM: 0.5", "0.5}", "unknown task of a tuning 'ARM'"),
        (", ARMS: 0.5", "", "{ratio", "no gain of 'ARMS'"),
        (" damping: 0.0001,", "", "{ratio", "no damping of 'ARMS'"),
        ("  track: manipulation\n", "", "hands:", "the key 'track' is missing"),
        ("arm_base", "manipulation", "manipulation\n  ref", "near itself"),
    ],
)
def test_mistakes_are_reported_at_their_place(build, tmp_path, before, after, place, message):
    text = TAGS.replace(before, after, 1)
    with pytest.raises(SolferError, match=f"(?s){message}") as error:
        build(text)
    begin = place_of(text, place, tmp_path / "hands.yaml")
    assert str(error.value).startswith(f"{begin}: hands")

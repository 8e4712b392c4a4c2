"""Distances between a robot's own links: finite differences, pairs, and tasks that would make links touch."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.needs import pybullet_robot

from solfer import Robot
from solfer.config import read
from solfer.config.tasks.stack import StackRecord
from solfer.errors import SolferError
from solfer.model.collisions.distances import LinkDistances, pairs_that_may_touch
from solfer.tasks import CollisionLimit, build_stack

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
STEP = 1e-4  # [s] coal finds the distance of curved shapes to 1e-6 m
PERIOD = 0.005  # [s]

ROBOTS = {
    "centauro": (
        lambda: Robot.load(CENTAURO / "centauro.urdf", CENTAURO / "centauro.srdf"),
        [("arm1_6", "arm2_6"), ("arm1_5", "arm2_3"), ("wheel_1", "wheel_2"), ("arm1_6", "pelvis")],
    ),
    "quadruped": (
        lambda: Robot.load(pybullet_robot("a1/a1.urdf"), floating_base=True),
        [("FR_lower", "RL_lower"), ("FR_lower", "FL_upper"), ("FL_lower", "trunk")],
    ),
}

HANDS = """
stack:
  policy: stop
  tasks: {hands: {point: position, link: [arm1_7, arm2_7], relative: torso_2, gain: 20}, p: {point: posture}}
  levels: [[hands], [p]]
  limits: {collisions: {distance: 0.05, influence: 0.3, pairs: [[left_arm, right_arm]]}}
"""


@pytest.fixture
def robot():
    robot = ROBOTS["centauro"][0]()
    dofs, values = robot.named_state("home")
    robot.state.position[dofs] = values
    robot.update()
    return robot


@pytest.mark.parametrize("name", ROBOTS)
def test_rows_are_the_derivatives_of_distances(name):
    """Central differences of distances at random postures are the oracle, where nearest points do not jump."""
    load, pairs = ROBOTS[name]
    robot = load()
    limit = CollisionLimit(LinkDistances(robot.kinematics, pairs, 5.0, most=1000), robot, 0.0)
    limit.set_horizon(PERIOD)
    random, compared, agreed = np.random.default_rng(3), 0, 0

    def distances(position):
        robot.state.position[:] = position
        robot.update()
        limit.update()
        near = limit.distances
        return np.sort(near.distance[: near.count])

    for _ in range(10):
        position, velocity = random.uniform(-0.8, 0.8, (2, robot.size))
        after, before = distances(position + STEP * velocity), distances(position - STEP * velocity)
        values = distances(position)
        # nearest points of parallel faces jump, and distances that cross change places
        distinct = np.diff(values, prepend=-1.0, append=9.0) > 1e-4
        steady = (values > 1e-3) & distinct[1:] & distinct[:-1]
        rates = (limit.matrix @ velocity)[: len(values)]
        close = np.isclose(rates, (after - before) / (2.0 * STEP), atol=2e-3)
        agreed += np.count_nonzero(close & steady)
        compared += np.count_nonzero(steady)
    # at an edge the nearest points jump
    assert compared >= 20 and agreed > 0.9 * compared


@pytest.mark.slow
def test_hands_that_are_drawn_together_stay_apart(robot, tmp_path):
    """Both hands get the same reference: the least distance of all links of the arms settles at the 5 cm limit."""
    file = tmp_path / "stack.yaml"
    file.write_text(HANDS)
    stack = build_stack(read(file, StackRecord, ("stack",)), robot)
    solver = stack.solver(PERIOD)
    hands = [stack.references[f"hands/arm{side}_7"] for side in (1, 2)]
    middle = np.mean([reference.value for reference in hands], axis=0)
    watched = LinkDistances(robot.kinematics, list(product(robot.links("left_arm"), robot.links("right_arm"))), 5.0)
    for reference in hands:
        reference.set(middle)
    nearest = np.inf
    for _ in range(400):
        robot.state.position[:] += PERIOD * solver.update()
        robot.update()
        watched.update()
        nearest = min(nearest, watched.distance[0])
    assert 0.048 < nearest < 0.06


def test_pairs_of_the_srdf_are_left_out():
    robot = Robot.load(pybullet_robot("kuka_iiwa/model.urdf"), floating_base=False)
    links = [("lbr_iiwa_link_7", "lbr_iiwa_link_0"), ("lbr_iiwa_link_7", "lbr_iiwa_link_3")]
    kinematics = robot.kinematics.twin()
    pairs = pairs_that_may_touch(kinematics, [], 0.0, np.zeros(robot.size))
    fewer = pairs_that_may_touch(kinematics, [frozenset(links[0])], 0.0, np.zeros(robot.size))
    as_sets = [set(map(frozenset, some)) for some in (pairs, fewer)]
    assert as_sets[0] - as_sets[1] == {frozenset(links[0])}
    assert frozenset(("lbr_iiwa_link_3", "lbr_iiwa_link_4")) not in as_sets[0]


def test_an_srdf_names_links_that_never_touch(tmp_path):
    text = (CENTAURO / "centauro.srdf").read_text()
    row = '<disable_collisions link1="arm1_7" link2="{}" reason="Never"/>'
    srdf = text.replace("</robot>", row.format("wheel_4") + row.format("tail") + "</robot>")
    robot = Robot.load(CENTAURO / "centauro.urdf", srdf)
    assert robot.semantics.apart == {frozenset(("arm1_7", "wheel_4"))}


def test_links_without_shapes_are_refused(robot):
    with pytest.raises(SolferError, match="has collision shapes"):
        LinkDistances(robot.kinematics, [("imu_link", "pelvis")], 0.1)


@pytest.mark.parametrize(
    ("pair", "place", "message"),
    [
        ("[left_armm, right_arm]", "6:66", "unknown link or group 'left_armm'.*left_arm"),
        ("[arm1_1, arm1_2]", "6:24", "no two links may touch"),
    ],
)
def test_mistakes_are_reported_at_their_place(robot, tmp_path, pair, place, message):
    file = tmp_path / "stack.yaml"
    file.write_text(HANDS.replace("[left_arm, right_arm]", pair))
    with pytest.raises(SolferError, match=f"(?s){message}") as error:
        build_stack(read(file, StackRecord, ("stack",)), robot)
    assert str(error.value).startswith(f"{file}:{place}")


@pytest.mark.slow
def test_without_pairs_all_that_may_touch_counts(robot, tmp_path):
    file = tmp_path / "stack.yaml"
    file.write_text(HANDS.replace(", pairs: [[left_arm, right_arm]]", ""))
    stack = build_stack(read(file, StackRecord, ("stack",)), robot)
    velocity = stack.solver(PERIOD).update()
    assert_allclose(velocity, 0.0, atol=1e-6)

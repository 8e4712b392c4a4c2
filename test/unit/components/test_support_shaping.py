"""The component `support_shaping`: the original's motion, margins and workspaces that are kept, what is infeasible."""

import gzip
import importlib.util
import json
import logging

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import nnls
from support.robots import centauro
from support.unit.declarations import named

from solfer.components.support_shaping import SupportShaping
from solfer.components.support_shaping.governor import Reaction
from solfer.components.support_shaping.polygon import FootprintGeometry
from solfer.components.support_shaping.rolling import rolling_map, vertex_map
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.targets import WheelsSupport
from solfer.config import load
from solfer.errors import ComponentError, SizeMismatch, UnknownName
from solfer.points import SpatialPoint, SupportVertex

RATE, PERIOD, LOWER = 200.0, 0.005, 30  # [Hz], [s], DoFs of the lower body and the base
FRONT, RIGHT, LEFT, REAR = (
    "margin wheel_1-wheel_2",
    "margin wheel_2-wheel_4",
    "margin wheel_3-wheel_1",
    "margin wheel_4-wheel_3",
)
INWARDS = (0.0, -0.05, 0.0, 0.0, 0.05, 0.0) * 2
"""Velocities that make the polygon narrower [m/s]."""


@pytest.fixture(scope="module")
def recorded(repository):
    return json.loads(gzip.decompress((repository / "test/data/original_shaping.json.gz").read_bytes()))


@pytest.fixture(scope="module")
def player(repository):
    """Return the module of the benchmark that plays recorded motions."""
    file = repository / "benchmark/driving_cases/golden_shaping.py"
    spec = importlib.util.spec_from_file_location("benchmark_golden_shaping", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def robot():
    return centauro("mammal_wide_straight")


@pytest.fixture
def make(repository, robot):
    """Make the component of the shipped configuration with other tags, at its start."""

    def make(**tags):
        record = load(repository / "config/centauro.yaml", "support_shaping").tags(SupportShaping.Tags)
        component = SupportShaping(robot, record.model_copy(update=tags).placed_as(record), "shaping")
        component.set_rate(RATE)
        component.init()
        return component

    return make


def cycle(component, count=1, support=None):
    """Run cycles in which the robot does what is commanded; velocities of vertices come at 20 Hz."""
    robot = component.model
    for index in range(count):
        if support is not None and index % 10 == 0:
            named(component.topics(), "wheels_support").handler(WheelsSupport(velocity=support))
        robot.update()
        component.update()
        component.send()
        robot.state.position[:LOWER] = robot.command.position[:LOWER]
        robot.state.velocity[:LOWER] = robot.command.velocity[:LOWER]


def reserve(component, name):
    collect = named(component.topics(), "support_margins").collect
    message = next(message for message in iter(collect, 0) if message is not None)
    return dict(zip(message.names, message.reserves, strict=True))[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rest", "forward"])
def test_recorded_motions_are_met(repository, recorded, player, robot, name):
    tags = load(repository / "config/centauro.yaml", "wheeled_motion").tags(WheeledMotion.Tags)
    found, expected = player.play_shaping(recorded[name], robot, tags)
    assert np.ptp(expected, axis=0).max() > 0.1
    assert_allclose(found, expected, rtol=0.0, atol=1e-8)


def test_first_program_and_its_solution(repository, recorded, player, robot):
    """The original's recorded Hessian and solution are one oracle, plain least squares on its constraints the other."""
    tags = load(repository / "config/centauro.yaml", "wheeled_motion").tags(WheeledMotion.Tags)
    robot.state.position[:] = recorded["rest"]["q0"]
    player.limit(robot)
    robot.update()
    component = SupportShaping(robot, player.shaping_tags(tags), "shaping")
    component.set_rate(RATE)
    forces = player.OriginalForces(robot, RATE)
    component.init()
    forces.update()
    component.update()
    solver, qp = component.original.program.solver, {name: np.array(value) for name, value in recorded["qp"].items()}
    assert_allclose(solver.problem.hessian, qp["H"], rtol=0.0, atol=1e-12)
    solution = solver.solve().x
    assert_allclose(solution, recorded["rest"]["x"], rtol=0.0, atol=1e-8)
    assert_allclose(by_least_squares(qp), solution, rtol=0.0, atol=1e-6)


def by_least_squares(qp):
    """Solve min x'Hx with CE x = -ce, CI x >= -ci by Lawson's and Hanson's reduction to non-negative least squares."""
    _, _, rows = np.linalg.svd(qp["CE"])
    free = rows[np.linalg.matrix_rank(qp["CE"]) :].T
    start = np.linalg.lstsq(qp["CE"], -qp["ce"], rcond=None)[0]
    factor = np.linalg.cholesky(free.T @ qp["H"] @ free).T
    shift = np.linalg.solve(factor.T, free.T @ qp["H"] @ start)
    matrix = qp["CI"] @ free @ np.linalg.inv(factor)
    bound = -qp["ci"] - qp["CI"] @ start + matrix @ shift
    size = np.maximum(np.linalg.norm(matrix, axis=1), 1e-12)
    matrix, bound = matrix / size[:, None], bound / size
    scale = np.abs(bound).max()
    stacked = np.vstack((matrix.T, bound / scale))
    target = np.append(np.zeros(matrix.shape[1]), 1.0)
    residual = stacked @ nnls(stacked, target, maxiter=10000)[0] - target
    least = -scale * residual[:-1] / residual[-1]
    return start + free @ np.linalg.solve(factor, least - shift)


def test_margins_and_their_gradients():
    """Finite differences under random motions of the vertices and the point are the oracle for each edge."""
    random = np.random.default_rng(3)
    vertices = np.array([(0.5, 0.3, 0.0), (0.6, -0.2, 0.0), (-0.5, 0.3, 0.0), (-0.4, -0.35, 0.0)])
    polygon, point, step = FootprintGeometry(4), np.array((0.05, 0.02)), 1e-7
    polygon.start(vertices)
    assert polygon.edges == [(0, 1), (1, 3), (2, 0), (3, 2)]
    polygon.update(vertices.tolist(), point.tolist())
    margins, start, end = (each.copy() for each in (polygon.margins, polygon.of_start, polygon.of_end))
    of_point = polygon.of_point.copy()
    assert (margins > 0.0).all() and margins[1] == pytest.approx(0.25, abs=0.05)
    moved, pushed = random.normal(size=(4, 2)), random.normal(size=2)
    vertices[:, :2] += step * moved
    polygon.update(vertices.tolist(), (point + step * pushed).tolist())
    expected = [
        start[index] @ moved[first] + end[index] @ moved[second] + of_point[index] @ pushed
        for index, (first, second) in enumerate(polygon.edges)
    ]
    assert_allclose((polygon.margins - margins) / step, expected, atol=1e-5)


def test_rolling_wheel_carries_its_vertex(robot):
    robot.state.position[robot.dof("hip_yaw_1")] += 0.2
    robot.state.position[robot.dof("ankle_pitch_1")] += 0.1
    robot.update()
    vertex, center = SupportVertex("wheel_1", robot, 0.01, 0.068), SpatialPoint("wheel_1", robot)
    vertex.update()
    center.update()
    axis = robot.kinematics.rotation("wheel_1")[:, 2]
    about = vertex_map(axis, 0.01) @ center.jacobian[3:]
    assert_allclose(about, vertex.jacobian - center.jacobian[:3], atol=1e-12)
    spin = np.array((0.1, 12.0, 0.4))
    rolled = rolling_map(axis, spin, 0.01, 0.068, PERIOD)[:, :2] @ spin[:2]
    way = vertex.value - center.value[:3]
    flat = spin * (1.0, 1.0, 0.0)
    assert_allclose(rolled, vertex_map(axis, 0.01) @ flat - np.cross(flat, way), atol=1e-12)


def test_a_margin_is_kept(make):
    component = make(margins=(0.25,), workspaces=(0.75,), balance="center_of_mass", base="center_of_mass")
    before = component.shaping.measure.polygon.margins.copy()
    cycle(component, 600, INWARDS)
    assert component.shaping.measure.polygon.margins[1] < before[1] - 0.02
    assert min(reserve(component, name) for name in (RIGHT, LEFT)) > -2e-3
    message = component.shaping.report.margins()
    assert {RIGHT, LEFT} <= set(message.active) and not message.infeasible and message.share == 1.0


def test_without_limits_in_reach_nothing_changes(make, repository, robot):
    shaped = make(margins=(0.01,), workspaces=(2.0,))
    cycle(shaped, 100, INWARDS)
    position = shaped.model.command.position.copy()
    assert np.abs(shaped.references.vertex_velocity).max() > 0.04
    dofs, values = robot.named_state("mammal_wide_straight")
    robot.state.position[:], robot.state.velocity[:] = 0.0, 0.0
    robot.state.position[dofs] = values
    robot.update()
    tags = load(repository / "config/centauro.yaml", "wheeled_motion").tags(WheeledMotion.Tags)
    plain = WheeledMotion(robot, tags, "plain")
    plain.set_rate(RATE)
    plain.init()
    cycle(plain, 100, INWARDS)
    assert_allclose(plain.model.command.position[:LOWER], position[:LOWER], atol=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_beyond_its_range_may_rest(make, robot, side):
    component, joint = make(law="original"), robot.dof("ankle_pitch_1")
    limits = robot.upper_limits if side > 0.0 else robot.lower_limits
    robot.state.position[joint] = limits.position[joint] + 0.1 * side
    robot.update()
    component.update()
    problem, place = component.original.program.solver.problem, list(component.moved).index(joint)
    speed = robot.upper_limits.velocity[joint]
    assert (problem.x_min[place], problem.x_max[place]) == ((-speed, 0.0) if side > 0.0 else (0.0, speed))


@pytest.mark.slow
def test_a_leg_stays_within_reach(make):
    component = make(margins=(0.05,), workspaces=(0.64,), balance="center_of_mass")
    cycle(component, 1000, tuple(-each for each in INWARDS))
    assert component.shaping.measure.polygon.distances.max() == pytest.approx(0.64, abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("policy", "share", "words"), [("slow", 0.2, "slows down"), ("hold", 0.0, "holds")])
def test_infeasible_margins_let_it_stand(make, caplog, policy, share, words):
    caplog.set_level(logging.WARNING)
    component = make(margins=(1.5,), workspaces=(0.63,), infeasible=policy, balance="center_of_mass")
    cycle(component, 1500, (0.0,) * 12)
    before = component.model.command.position.copy()
    cycle(component, 400)
    assert component.shaping.governor.ratio == pytest.approx(share)
    assert FRONT in component.shaping.report.margins().infeasible or reserve(component, FRONT) < -0.5
    assert f"'{FRONT}' cannot be kept" in caplog.text and words in caplog.text
    assert np.abs(component.model.command.position - before)[:LOWER].max() < 2e-2
    assert np.isfinite(component.model.command.velocity).all()


def test_a_warning_comes_before_the_limit(make, caplog):
    caplog.set_level(logging.WARNING)
    component = make(margins=(0.25,), workspaces=(2.0,), balance="center_of_mass", warn_below=0.05)
    cycle(component, 1)
    assert RIGHT not in caplog.text
    while reserve(component, RIGHT) > 0.045:
        cycle(component, 10, INWARDS)
    assert f"m are left of '{RIGHT}'" in caplog.text and not component.shaping.governor.active.any()


def test_limits_that_change_are_published(make):
    component = make()
    parameter = next(each for each in component.live_parameters() if each.path == ("margins",))
    parameter.write(np.array((4 * [0.07], 4 * [0.6])))
    assert component.shaping.report.margins().limits == (*4 * [0.07], *4 * [0.6])


def test_pressure_counts_where_contacts_press(make, robot):
    component = make(balance="center_of_pressure")
    cycle(component, 1)
    middle = component.shaping.measure.polygon.margins.copy()
    for name, force in zip(robot.contacts.names[:4], (400.0, 400.0, 100.0, 100.0), strict=True):
        robot.contacts[name].wrench[2] = force
    cycle(component, 1)
    margins = component.shaping.measure.polygon.margins
    assert margins[0] < middle[0] - 0.1 and margins[3] > middle[3] + 0.1


def test_the_polygon_follows_a_push():
    vertices = [[0.5, 0.3, 0.0], [0.5, -0.3, 0.0], [-0.5, 0.3, 0.0], [-0.5, -0.3, 0.0]]
    reaction = Reaction(4, 0.2, 2.0)
    reaction.start([(0, 1), (1, 3), (2, 0), (3, 2)])
    assert reaction.update(vertices, (0.0, 0.0, 0.9), (0.5, 0.0), PERIOD) == (0.0, 0.0) and not reaction.is_active
    for _ in range(20):
        x, y = reaction.update(vertices, (0.0, 0.0, 0.9), (1.6, 0.3), PERIOD)
    assert reaction.is_active and x > 0.2 and y == pytest.approx(0.0, abs=1e-9)
    for _ in range(2000):
        x, y = reaction.update(vertices, (0.0, 0.0, 0.9), (x, y), PERIOD)
    assert (x, y) == (0.0, 0.0) and not reaction.is_active


def test_a_reaction_drives_the_wheels(make, robot):
    component = make(reactive=True, reactive_margin=0.4)
    for _ in range(20):
        robot.update()
        robot.state.velocity[0] = 2.0
        component.update()
        component.send()
    speeds = component.model.command.velocity[[robot.dof(f"j_wheel_{leg}") for leg in (1, 2, 3, 4)]]
    assert (speeds * (1.0, -1.0, 1.0, -1.0) > 1.0).all()


@pytest.mark.parametrize(
    ("tags", "error", "words"),
    [
        ({"margins": (0.1, 0.2)}, SizeMismatch, "2 numbers in 'margins'"),
        ({"workspaces": (0.6,) * 3}, SizeMismatch, "3 numbers in 'workspaces'"),
        ({"hips": "hip"}, UnknownName, "hips"),
        ({"hips": "base"}, ComponentError, "1 links in 'base' for 4 wheels"),
        ({"ik": ("CONSTRAINTS", "BASE")}, ComponentError, "no CONTACT_POINTS among the tasks"),
        ({"ik": ("CONSTRAINTS", "BASE", "CONTACT_POINTS"), "law": "original"}, ComponentError, "no STEERING, CAMBER"),
    ],
)
def test_mistakes_are_named(make, tags, error, words):
    with pytest.raises(error, match=words):
        make(**tags)

"""Quadratic programs that the components solve, recorded at random states."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pybullet_data
from points import PERIOD, ROOT, URDF
from tasks import CONTACTS, NOMINAL, SRDF, three_levels

from solfer import Robot
from solfer.components import Component
from solfer.components.inverse_dynamics import InverseDynamics
from solfer.components.inverse_dynamics import problem as whole_body
from solfer.components.support_shaping import SupportShaping
from solfer.components.wheeled_motion.targets import WheelsSupport
from solfer.config import load
from solfer.numerics.solvers.qp import Problem, QpSolver, QpStatus
from solfer.points import LinearPoint
from solfer.tasks import QpHierarchy, Task, joint_bounds

CONFIG, KUKA = ROOT / "config/centauro.yaml", Path(pybullet_data.getDataPath(), "kuka_iiwa/model.urdf")
RATE = 200.0  # [Hz]
INWARDS = np.array((0.0, -0.05, 0.0, 0.0, 0.05, 0.0) * 2)
"""Velocities that make the support polygon narrower [m/s]."""


@contextmanager
def recording(found: list[Problem]) -> Iterator[None]:
    """Append each problem that is solved meanwhile."""
    write = QpSolver.write

    def record(self: QpSolver, out: np.ndarray) -> tuple[QpStatus, int, float]:
        found.append(self.problem.copy())
        return write(self, out)

    QpSolver.write = record  # type: ignore[method-assign]
    try:
        yield
    finally:
        QpSolver.write = write  # type: ignore[method-assign]


def whole(*given: Any) -> Problem:
    """Return the problem of an inverse dynamics with all accelerations and forces; see `build` for what is given."""
    inertia, bias, held, demanded, unit, passive, holds, jacobian, desired, smallest, driven, torques = given[:12]
    cones, normals, largest, lower, upper = given[12:17]
    size = len(bias)
    count = len(demanded)
    dynamics = np.hstack((inertia, -unit * held.T))
    hessian = np.diag(smallest)
    hessian[:size, :size] += jacobian.T @ jacobian
    kept = np.hstack((held, np.zeros((count, count))))
    kept[~holds] = np.eye(size + count)[size:][~holds]
    forces = np.hstack((np.zeros((len(cones) + len(normals), size)), np.vstack((cones, normals))))
    free = np.full(count, np.inf)
    return Problem(
        hessian,
        np.concatenate((-jacobian.T @ desired, np.zeros(count))),
        np.vstack((dynamics[passive], kept)),
        equality_vector=np.concatenate((-bias[passive], np.where(holds, demanded, 0.0))),
        inequality_matrix=np.vstack((dynamics[driven], forces)),
        lower=np.concatenate((-torques - bias[driven], np.full(len(cones), -np.inf), np.zeros(len(normals)))),
        upper=np.concatenate((torques - bias[driven], np.zeros(len(cones)), largest / unit)),
        x_min=np.concatenate((lower, -free)),
        x_max=np.concatenate((upper, free)),
    )


def centauro() -> Robot:
    """Load CENTAURO as it stands."""
    robot = Robot.load(URDF, SRDF, actuators=URDF.with_name("actuators.yaml"), contacts=CONTACTS, name="centauro")
    indices, values = robot.named_state("mammal_wide_straight")
    robot.state.position[indices] = values
    robot.update()
    return robot


def kuka() -> Robot:
    """Load an arm on a fixed base, bent."""
    robot = Robot.load(KUKA, floating_base=False)
    robot.state.position[:] = 0.5
    robot.update()
    return robot


def dynamics(robot: Robot, tags: Any, draws: tuple[int, float, float], random: np.random.Generator) -> list[Problem]:
    """Record an inverse dynamics at a number of states, each twice: what it solves, and with all unknowns.

    Args:
        robot: The Robot where it starts.
        tags: Tags of the component.
        draws: Number of states, largest distance from the start [rad, m], and standard deviation of velocities.
        random: Draws states.
    """
    component = InverseDynamics(robot, tags)
    home = robot.state.position.copy()
    component.set_rate(RATE)
    component.start_position = home
    component.init()
    count, spread, speed = draws
    found: list[Problem] = []
    build = whole_body.build

    def record(*given: Any) -> Any:
        found.append(whole(*given))
        return build(*given)

    whole_body.build = record
    try:
        for _ in range(count):
            robot.state.position[:] = home + random.uniform(-spread, spread, robot.size)
            robot.state.velocity[:] = random.normal(0.0, speed, robot.size)
            with recording(found):
                step(component)
            component._watch.start()  # no motion leads to this state
    finally:
        whole_body.build = build
    return found


def step(component: Component) -> None:
    """Run a cycle of a component."""
    component.model.update()
    component.model.dynamics.update()
    component.update()
    component.send()


def levels(robot: Robot, tasks: list[Task], count: int, random: np.random.Generator) -> list[Problem]:
    """Record levels of tasks at a number of states, with the speeds that the joints have in them far too slow."""
    home = robot.state.position.copy()
    solver = QpHierarchy(tasks, joint_bounds(robot, PERIOD))
    found: list[Problem] = []
    for _ in range(count):
        robot.state.position[:] = home + random.uniform(-0.5, 0.5, robot.size)
        robot.update()
        with recording(found):
            solver.update()
    return found


def shaping(random: np.random.Generator, law: str, cycles: int) -> list[Problem]:
    """Record a support polygon that becomes narrower, by either law."""
    robot = centauro()
    tags = load(CONFIG, "support_shaping").tags(SupportShaping.Tags)
    margins = {"margins": (0.25,), "workspaces": (0.75,), "balance": "center_of_mass", "base": "center_of_mass"}
    changed = margins if law != "original" else {"law": law, "margins": (0.5, 0.3, 0.3, 0.6), "workspaces": (0.65,)}
    component = SupportShaping(robot, tags.model_copy(update=changed).placed_as(tags), "shaping")
    component.set_rate(RATE)
    component.init()
    found: list[Problem] = []
    for index in range(cycles):
        if index % 10 == 0:
            velocity = tuple(INWARDS + 0.02 * random.normal(size=12))
            component.topics()[2].handler(WheelsSupport(velocity=velocity))
        with recording(found):
            step(component)
        robot.state.position[:30] = robot.command.position[:30]
        robot.state.velocity[:30] = robot.command.velocity[:30]
    return found


def thinned(found: list[Problem], count: int) -> list[Problem]:
    """Return as many problems, evenly."""
    return [found[index] for index in np.unique(np.linspace(0, len(found) - 1, count).astype(int))]


def altered(found: list[Problem], random: np.random.Generator, alter: Callable[..., None]) -> list[Problem]:
    """Return copies of problems that are altered."""
    copies = [problem.copy() for problem in found]
    for problem in copies:
        alter(problem, random)
    return copies


def repeat(problem: Problem, random: np.random.Generator) -> None:
    """Let two inequalities depend on others almost: by 1e-6 to 1e-12."""
    rows = problem.inequality_matrix
    for _ in range(2 if len(rows) > 1 else 0):
        of, to = random.choice(len(rows), 2, replace=False)
        rows[to] = rows[of] + 10.0 ** random.uniform(-12.0, -6.0) * random.normal(size=rows.shape[1])
        problem.lower[to], problem.upper[to] = problem.lower[of], problem.upper[of]


def flatten(problem: Problem, random: np.random.Generator) -> None:
    """Scale one direction of the cost down, until it is almost flat: to 1e-8 to 1e-12 of the largest curvature."""
    values, vectors = np.linalg.eigh(problem.hessian)
    values = np.maximum(values, values[-1] * 10.0 ** random.uniform(-12.0, -8.0))
    problem.hessian[:] = (vectors * values) @ vectors.T
    problem.hessian[:] = 0.5 * (problem.hessian + problem.hessian.T)


def contradict(problem: Problem, random: np.random.Generator) -> None:
    """Let an inequality contradict another one, by 1e-2 to 1e-6 of its limit."""
    rows = problem.inequality_matrix
    of, to = random.choice(len(rows), 2, replace=False)
    gap = 10.0 ** random.uniform(-6.0, -2.0)
    rows[to] = rows[of]
    if np.isfinite(problem.upper[of]):
        problem.lower[to] = problem.upper[of] + gap * max(1.0, abs(problem.upper[of]))
        problem.upper[to] = np.inf
    else:
        problem.lower[of] = 0.0
        problem.lower[to], problem.upper[to] = -np.inf, -gap


def limited(tags: Any, scale: float) -> Any:
    """Return the tags of an inverse dynamics with a share of the torques."""
    limits = tags.stack.limits.model_copy(update={"torque_scale": scale})
    stack = tags.stack.model_copy(update={"limits": limits}).placed_as(tags.stack)
    return tags.model_copy(update={"stack": stack}).placed_as(tags)


def draw(seed: int) -> Iterator[tuple[str, list[Problem]]]:
    """Yield the problems by cases, 1 000 altogether."""
    random = np.random.default_rng(seed)
    squat = load(CONFIG, "squat").tags(InverseDynamics.Tags)
    base: list[Problem] = []
    for what, scale, draws in (
        ("squat", 1.0, (100, 0.02, 0.02)),
        ("pushed", 0.5, (100, 0.1, 0.3)),
        ("overloaded", 0.02, (50, 0.1, 0.8)),
    ):
        found = dynamics(centauro(), limited(squat, scale), draws, random)
        yield f"dynamics, {what}, reduced", found[1::2]
        yield f"dynamics, {what}, whole", found[::2]
        base += found[1:60:2] if scale < 1.0 else []
    with redirect_stderr(StringIO()):
        arm = kuka()
    posture = {"tasks": {"posture": {"point": "posture", "gain": 20}}, "levels": (("posture",),)}
    tags = InverseDynamics.Tags.model_validate({"stack": posture})
    yield "dynamics, KUKA", dynamics(arm, tags, (50, 0.5, 1.0), random)[1::2]
    robot = Robot.load(URDF)
    for index, dof in enumerate(robot.dofs):
        robot.state.position[index] = sum(angle for part, angle in NOMINAL.items() if part in dof)
    robot.update()
    tasks = three_levels(robot, gain=20.0, dofs=robot.actuated.tolist())
    found = levels(robot, tasks, 80, random)
    yield "levels, CENTAURO", thinned(found, 100)
    tasks = [Task(link, LinearPoint(f"lbr_iiwa_link_{link}", arm), gain=20.0) for link in "74"]
    for task in tasks:
        task.reference.set(task.point.value + 0.1)
    yield "levels, KUKA", thinned(levels(arm, tasks, 80, random), 50)
    yield "shaping", thinned(shaping(random, "margins", 400), 50)
    original = thinned(shaping(random, "original", 100), 50)
    yield "shaping, original law", original
    base += original[:20]
    yield "almost dependent", altered(base[:70], random, repeat)
    yield "almost flat", altered(found[:30] + base[:50], random, flatten)
    yield "contradicting", altered(base[:50], random, contradict)

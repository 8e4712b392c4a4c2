#!/usr/bin/env python3
"""Cost of kinematics, Points and Handler on CENTAURO (48 DoFs), beside the original program's and other libraries'.

Run with `./run exec python benchmark/points.py [CALLS]`. Times in microseconds, every call timed alone; 1 u is one
`pinocchio.computeAllTerms` on the same robot in the same run, so that machines can be compared. Before each call the
robot is put into another random state, so that nothing is left from the call before. Pink and PlaCo take part where
they can be imported; each needs an environment of its own (`pip install pin-pink quadprog`, `pip install placo`).
"""

import gc
import importlib.util
import itertools
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pinocchio
from form import Figures, parser_of

ROOT = Path(__file__).resolve().parents[1]
URDF = ROOT / "config/robots/centauro/centauro.urdf"
LINKS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm1_7", "arm2_7", "pelvis", "torso_2")
HANDS, TORSO = ("arm1_7", "arm2_7"), "torso_2"
DAMPING = 1e-3
PERIOD = 0.002  # [s]
RANGE, STATES = 0.5, 61
"""Largest distance of a joint from the posture [rad], largest velocity [rad/s], and number of random states."""
ROUNDS = 7
"""Number of times that a cycle and the unit are measured, one after the other."""

Times = tuple[float, float]
"""Median and 99th percentile [us]."""


def measure(work: Callable[[], object], calls: int, between: Callable[[], object] = lambda: None) -> Times:
    """Measure `work`, with `between` before each call."""
    times = np.zeros(calls)
    for index in range(calls):
        between()
        start = time.perf_counter_ns()
        work()
        times[index] = 1e-3 * (time.perf_counter_ns() - start)
    return float(np.median(times)), float(np.percentile(times, 99))


class RandomStates:
    """Moves a robot to the next of some random states around the one that it has, at rest, when this is made.

    Near zero, sines and cosines are computed faster than at angles as robots have them.

    Args:
        robot: The robot.
    """

    def __init__(self, robot):
        self._state = robot.state
        offsets, velocities = np.random.default_rng(0).uniform(-RANGE, RANGE, (2, STATES, robot.size))
        self._states = itertools.cycle(list(zip(robot.state.position + offsets, velocities, strict=True)))

    def __call__(self) -> None:
        """Put the robot into the next state."""
        self._state.position, self._state.velocity = next(self._states)


def unit(calls: int) -> float:
    """Measure `computeAllTerms` on the robot with a free-flyer at random states; its median [us]."""
    text = URDF.read_text().replace('type="floating"', 'type="fixed"')
    model = pinocchio.buildModelFromXML(text, pinocchio.JointModelFreeFlyer())
    data, neutral = model.createData(), pinocchio.neutral(model)
    offsets, velocities = np.random.default_rng(0).uniform(-RANGE, RANGE, (2, STATES, model.nv))
    states = itertools.cycle(
        [(pinocchio.integrate(model, neutral, row), v) for row, v in zip(offsets, velocities, strict=True)]
    )
    q, v = neutral.copy(), np.zeros(model.nv)

    def move() -> None:
        q[:], v[:] = next(states)

    return measure(lambda: pinocchio.computeAllTerms(model, data, q, v), calls, move)[0]


def in_units(cycle: Callable[[], object], calls: int, move: Callable[[], None]) -> float:
    """Measure a cycle in u: the median of rounds, each of which measures both, since other work comes and goes."""
    part = max(calls // ROUNDS, 20)
    return float(np.median([measure(cycle, part, move)[0] / unit(part) for _ in range(ROUNDS)]))


def ours(calls: int) -> Iterator[tuple[str, str, Times, float | None]]:
    """Measure each row: its letter, what it is, our times, and the original's median in u."""
    from solfer import Robot
    from solfer.points import CenterOfMass, Handler, LinearPoint

    robot = Robot.load(URDF)
    move = RandomStates(robot)

    def move_on() -> None:
        move()
        robot.update()

    yield "a", "robot.update() from q, v", measure(robot.update, calls, move), 0.18
    handler = Handler(LinearPoint(link, robot) for link in LINKS)
    yield "b", "Handler: 8 LinearPoints, Jacobians", measure(handler.update, calls, move_on), 0.21
    center = CenterOfMass(robot)
    yield "c", "centre of mass and Jacobian", measure(center.update, calls, move_on), 0.75
    yield "f", "Listing 3, whole cycle", measure(listing_3(robot), calls, move), 1.1
    for count in (1, 10, 100, 1000):
        handler = Handler(LinearPoint(LINKS[index % 8], robot) for index in range(count))
        times = measure(handler.update, max(calls // count, 100), move_on)
        yield "", f"Handler: {count} LinearPoints", times, None
    yield from dynamic_points(robot, calls, move)


def dynamic_points(robot, calls: int, move: Callable[[], None]) -> Iterator[tuple[str, str, Times, None]]:
    """Measure accelerations, and forces of the ground at four wheels; rows as in `ours`."""
    from solfer.points import ContactForces, Force, Handler, LinearAcceleration, RollingContact

    def move_on() -> None:
        move()
        robot.dynamics.update()

    handler = Handler(LinearAcceleration(link, robot) for link in LINKS)
    yield "", "Handler: 8 LinearAccelerations, Jacobians", measure(handler.update, calls, move_on), None
    force = Force(LINKS[0], robot)
    yield "", "bias and inverse inertia", measure(robot.dynamics.update, calls, lambda: (move(), robot.update())), None
    yield "", "Force that holds one link", measure(force.update, calls, move_on), None
    ground = ContactForces(RollingContact(link, robot, ring=0.01, tube=0.068) for link in LINKS[:4])
    yield "", "ContactForces of four wheels", measure(ground.update, calls, move_on), None


def listing_3(robot) -> Callable[[], object]:
    """Make one cycle of inverse kinematics of the centre of mass and of two hands relative to the torso."""
    from solfer.numerics.solvers.damped_inverse import DampedInverse
    from solfer.points import CenterOfMass, Constant, Handler, LinearPoint, Minus

    tasks, errors = Handler(), Handler()
    targets = [tasks.add(CenterOfMass(robot))]
    torso = tasks.add(LinearPoint(TORSO, robot))
    for link in HANDS:
        hand = tasks.add(LinearPoint(link, robot))
        targets.append(tasks.add(Minus(hand, torso)))
    robot.update()
    tasks.update()
    for target in targets:
        errors.add(Minus(target, Constant.like(target)))
    inverse, step = DampedInverse(errors.rows, errors.cols, DAMPING), np.zeros(robot.size)

    def cycle() -> None:
        robot.update()
        tasks.update()
        errors.update()
        inverse.solve(errors.jacobian, errors.value, step)

    return cycle


def pink_cycle() -> Callable[[], object]:
    """Make the cycle of the same tasks with Pink and quadprog."""
    import pink
    from pink.tasks import ComTask, RelativeFrameTask

    robot = pinocchio.RobotWrapper(
        pinocchio.buildModelFromXML(
            URDF.read_text().replace('type="floating"', 'type="fixed"'), pinocchio.JointModelFreeFlyer()
        )
    )
    configuration = pink.Configuration(robot.model, robot.data, pinocchio.neutral(robot.model))
    tasks = [ComTask(cost=1.0)]
    tasks += [RelativeFrameTask(hand, TORSO, position_cost=1.0, orientation_cost=0.0) for hand in HANDS]
    for task in tasks:
        task.set_target_from_configuration(configuration)
    q = configuration.q.copy()

    def cycle() -> None:
        configuration.update(q)
        pink.solve_ik(configuration, tasks, PERIOD, solver="quadprog", damping=DAMPING, limits=(), safety_break=False)

    return cycle


def placo_cycle() -> Callable[[], object]:
    """Make the cycle of the same tasks with PlaCo, which gives robots a floating base of its own."""
    import placo

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.urdf"
        path.write_text(URDF.read_text().replace('type="floating"', 'type="fixed"'))
        robot = placo.RobotWrapper(str(path), placo.Flags.ignore_collisions)
    solver = placo.KinematicsSolver(robot)
    robot.update_kinematics()
    solver.add_com_task(robot.com_world())
    for hand in HANDS:
        solver.add_relative_position_task(TORSO, hand, robot.get_T_a_b(TORSO, hand)[:3, 3])

    def cycle() -> None:
        robot.update_kinematics()
        solver.solve(False)

    return cycle


def main() -> None:
    """Print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("calls", nargs="?", type=int, default=20_000, help="that are timed (default: %(default)s)")
    given = parser.parse_args()
    calls, figures = given.calls, Figures(given.json)
    gc.disable()
    one = unit(calls)
    figures.row("1 u: computeAllTerms", p50_us=one)
    if importlib.util.find_spec("solfer"):
        for row, what, (median, high), original in ours(calls):
            figures.row(f"{row} {what}".strip(), p50_us=median, p99_us=high, p50_u=median / one, original_u=original)
    for name, module, make in (("Pink, quadprog", "pink", pink_cycle), ("PlaCo", "placo", placo_cycle)):
        if importlib.util.find_spec(module):
            median, high = measure(make(), calls // 10)
            figures.row(f"f the same with {name}", p50_us=median, p99_us=high, p50_u=median / one, original_u=None)
        else:
            print(f"f the same with {name}: not installed", file=sys.stderr)


if __name__ == "__main__":
    main()

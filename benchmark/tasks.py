#!/usr/bin/env python3
"""Cost of dynamics, hierarchies of tasks and QP levels on CENTAURO (48 DoFs), beside the original program's.

Run with `./run exec python benchmark/tasks.py [CALLS]`. Times in microseconds, every call timed alone; 1 u is one
`pinocchio.computeAllTerms` on the same robot in the same run, so that machines can be compared. The robot moves before
each call, so that nothing is left from the call before.
"""

import gc
from collections.abc import Callable, Iterator

import numpy as np
from form import Figures, parser_of
from points import HANDS, LINKS, PERIOD, ROOT, TORSO, URDF, RandomStates, Times, measure, unit

from solfer import Robot
from solfer.config import read
from solfer.config.tasks.stack import StackRecord
from solfer.dynamics import BIAS, INERTIA, INERTIA_INVERSE, CarryingTorques
from solfer.model.contacts import read_contacts
from solfer.points import CenterOfMass, Handler, LinearPoint, make_contact
from solfer.tasks import Hierarchy, QpHierarchy, Task, build_stack, joint_bounds

CONTACTS = ROOT / "config/robots/centauro/contacts.yaml"
SRDF = ROOT / "config/robots/centauro/centauro.srdf"
STACKS = {"hands": "CoM and two hands in YAML", "centauro": "CENTAURO's laboratory's stack"}
"""Files below test/data/stacks, and what they are."""
NOMINAL = {"hip_pitch": 0.3, "knee_pitch": 0.6, "ankle_pitch": 0.3, "arm1_4": -1.0, "arm2_4": -1.0}
"""Angles of joints by parts of their names, so that no limb is stretched [rad]."""

Row = tuple[str, str, Times, float | None]
"""Letter of the row, what it is, our times, and the original's median in u."""


def gravity_compensation(robot: Robot) -> Callable[[], object]:
    """Make a cycle of torques that hold the robot on its four wheels: QR of the contacts' Jacobian, with bias."""
    records = [record for record in read_contacts(CONTACTS, "centauro") if record.type == "wheel"]
    contacts = Handler(make_contact(record, robot) for record in records)
    carrying = CarryingTorques(robot.dynamics, np.arange(6))

    def cycle() -> None:
        contacts.update()
        carrying.update(contacts.jacobian)

    return cycle


def three_levels(robot: Robot, **tags: object) -> list[Task]:
    """Make three tasks: centre of mass above one hand above the other, all a little away from their references."""
    torso = LinearPoint(TORSO, robot)
    tasks = [Task("com", CenterOfMass(robot), **tags)]
    tasks += [Task(hand, LinearPoint(hand, robot) - torso, **tags) for hand in HANDS]
    for task in tasks:
        task.reference.set(task.point.value + 0.01)
    return tasks


def rows(calls: int) -> Iterator[Row]:
    """Measure all rows."""
    robot = Robot.load(URDF)
    for index, dof in enumerate(robot.dofs):
        robot.state.position[index] = sum(angle for part, angle in NOMINAL.items() if part in dof)
    move = RandomStates(robot)

    def move_on() -> None:
        move()
        robot.update()

    model = robot.dynamics
    yield (
        "e",
        "QR gravity compensation, 4 contacts, with bias",
        measure(gravity_compensation(robot), calls, move_on),
        2.3,
    )
    model.subscribe({BIAS: 1, INERTIA: 1, INERTIA_INVERSE: 1})
    yield "d", "bias, inertia, inverse inertia", measure(model.update, calls, move_on), 1.9
    points, center = Handler(LinearPoint(link, robot) for link in LINKS), CenterOfMass(robot)

    def everything() -> None:
        model.update()
        points.update()
        center.update()

    yield "j", "kinematics, 8 points, CoM, bias, inertia, inverse", measure(everything, calls, move), 3.3
    model.unsubscribe({BIAS: 1, INERTIA: 1, INERTIA_INVERSE: 1})
    yield from hierarchies(robot, calls, move)
    for what, kind, cycle, move_near in stacks():
        yield "", f"{what}, {kind}", measure(cycle, calls // 10, move_near), None


def hierarchies(robot: Robot, calls: int, move: Callable[[], None]) -> Iterator[Row]:
    """Measure the rows of hierarchies, with kinematics."""
    tasks, bounds = three_levels(robot), joint_bounds(robot, PERIOD)

    def cycle_of(solver: Hierarchy | QpHierarchy) -> Callable[[], object]:
        def cycle() -> None:
            robot.update()
            solver.update()

        return cycle

    yield "g", "three levels by null spaces, with kinematics", measure(cycle_of(Hierarchy(tasks)), calls, move), 3.0
    for count, what in enumerate(("one QP level", "two QP levels", "three QP levels"), 1):
        solver = QpHierarchy(tasks[:count], bounds, policy="stop")
        yield "", f"{what} with limits, with kinematics", measure(cycle_of(solver), calls // 10, move), None
    # without the base, which has no limits
    solver = QpHierarchy(three_levels(robot, gain=20.0, dofs=robot.actuated.tolist()), bounds)
    times = measure(cycle_of(solver), calls // 10, move)
    active = np.count_nonzero((solver.velocity <= bounds.lower) | (solver.velocity >= bounds.upper))
    yield "", f"the same, {active} velocities at a limit", times, None


def stacks() -> Iterator[tuple[str, str, Callable[[], None], Callable[[], None]]]:
    """Make cycles, with kinematics, of stacks of YAML near the state `home`: hands, and CENTAURO's laboratory's.

    Yields what each is, its method, the cycle, and what moves the robot before it.
    """
    robot = Robot.load(URDF, SRDF, contacts=CONTACTS)
    dofs, values = robot.named_state("home")
    robot.state.position[dofs] = values
    robot.update()
    random, home = np.random.default_rng(1), robot.state.position.copy()

    def move() -> None:
        robot.state.position[:] = home + random.uniform(-1e-3, 1e-3, robot.size)

    for name, what in STACKS.items():
        stack = build_stack(read(ROOT / f"test/data/stacks/{name}.yaml", StackRecord, ("stack",)), robot)
        stack.start()
        for kind, solver in (("null spaces", Hierarchy(stack.levels)), ("QPs", stack.solver(PERIOD))):

            def cycle(solver: Hierarchy | QpHierarchy = solver) -> None:
                robot.update()
                solver.update()

            yield what, kind, cycle, move


def main() -> None:
    """Print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("calls", nargs="?", type=int, default=20_000, help="that are timed (default: %(default)s)")
    given = parser.parse_args()
    calls, figures = given.calls, Figures(given.json)
    gc.disable()
    one = unit(calls)
    figures.row("1 u: computeAllTerms", p50_us=one)
    for row, what, (median, high), original in rows(calls):
        figures.row(f"{row} {what}".strip(), p50_us=median, p99_us=high, p50_u=median / one, original_u=original)


if __name__ == "__main__":
    main()

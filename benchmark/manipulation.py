#!/usr/bin/env python3
"""What inverse kinematics and compensation reach on CENTAURO.

Circles of the hands, what is out of reach, targets anywhere, cycles; how well soft springs and arms without stiffness
hold, and where links on springs are. Run with
`./run exec python benchmark/manipulation.py [--json] [--only CASES]`. Each figure is a line, with
`--json` an object with `case`, `value`, `unit`, `goal` and `met`; progress is on stderr. The exit code is 1 if a goal
is not met. 1 u is one `pinocchio.computeAllTerms` on the same robot in the same run.
"""

import argparse
import json
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import NamedTuple

import numpy as np
from manipulation_cases import compensation
from points import ROOT, URDF, in_units
from support.integration.carried import WRONG, with_other_masses
from tasks import CONTACTS, NOMINAL, STACKS, stacks, three_levels

from solfer import Robot
from solfer.components.inverse_kinematics import InverseKinematics
from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description
from solfer.model.urdf.cut import cut
from solfer.plugins import Registry, generate
from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.bundle import load_bundle, read_bundle
from solfer.tasks import Hierarchy, QpHierarchy, joint_bounds

RATE, PERIOD = 200.0, 0.005  # [Hz], [s]
HANDS = {"left": "arm1_7", "right": "arm2_7"}
CONFIG, SRDF = ROOT / "config/centauro.yaml", URDF.with_suffix(".srdf")
CIRCLE, TURN = 0.1, 5.0  # radius [m], time of a turn [s]


class Figure(NamedTuple):
    """One figure; `goal` is the most that it may be, or the least; without one it is only printed."""

    case: str
    value: float
    unit: str
    goal: float | None
    at_least: bool = False

    @property
    def met(self) -> bool:
        """Whether the goal is met."""
        if self.goal is None:
            return True
        return bool(self.value >= self.goal if self.at_least else self.value <= self.goal)


class Warnings(logging.Handler):
    """Collects warnings of the component."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a message."""
        self.messages.append(record.getMessage())


def standing(robot: Robot, state: str = "mammal_wide_straight") -> Robot:
    """Put a robot into a named state."""
    dofs, values = robot.named_state(state)
    robot.state.position[dofs] = values
    robot.update()
    return robot


def upper_body() -> Robot:
    """Load the upper body on a fixed base."""
    text = cut(Description.from_file(URDF), "torso_2", "upper")
    return standing(Robot.load(text, SRDF, others=[URDF]))


def component_of(robot: Robot, name: str) -> InverseKinematics:
    """Make the component of a shipped configuration, at its start."""
    component = InverseKinematics(robot, load(CONFIG, name).tags(InverseKinematics.Tags), name)
    component.set_rate(RATE)
    component.init()
    return component


def circle(start: np.ndarray, time: float) -> np.ndarray:
    """Return a point of a circle across x that begins at `start`, shape (3,) [m]."""
    angle = 2.0 * np.pi * time / TURN
    return start + CIRCLE * np.array((0.0, np.sin(angle), 1.0 - np.cos(angle)))


def circles_in_the_model() -> Iterator[Figure]:
    """Let both hands go round while the robot stands, without physics."""
    robot = standing(Robot.load(URDF, SRDF, contacts=CONTACTS))
    component, model = component_of(robot, "inverse_kinematics"), robot.twin()
    starts = {name: robot.kinematics.position(link).copy() for name, link in HANDS.items()}
    center, errors, shifts = robot.kinematics.center_of_mass.copy(), [], []
    for cycle in range(round(TURN / PERIOD)):
        for name, start in starts.items():
            port = component.references.targets[name].port
            port.value[:], port.fresh = circle(start, cycle * PERIOD), True
        component.update()
        component.send()
        model.state.position[:] = robot.state.position[:] = robot.command.position
        model.update()
        for name, link in HANDS.items():
            errors.append(np.linalg.norm(model.kinematics.position(link) - circle(starts[name], (cycle + 1) * PERIOD)))
        shifts.append(np.linalg.norm(model.kinematics.center_of_mass - center))
    yield Figure("circle, model, RMS of the hands", rms(errors), "m", 1e-3)
    yield Figure("circle, model, shift of the centre of mass", max(shifts), "m", 5e-3)


def circles_in_simulation(wrong: int | None = None) -> Iterator[Figure]:
    """Let both hands go round in PyBullet at 1 kHz, with the plugin at 200 Hz on the measured base.

    Args:
        wrong: Seed of masses and inertias of the simulated robot that are up to 20 % wrong; None: they are right.
    """
    bus = Bus({"/robot_description": URDF.read_text(), "/robot_semantic_description": SRDF.read_text()})
    world, what = URDF.read_text(), "circle, simulation"
    if wrong is not None:
        world, what = with_other_masses(world, WRONG, wrong), f"{what}, masses 20 % wrong, seed {wrong}"
    bundle = read_bundle(URDF.with_name("robot.yaml")).with_perfect_sensors()
    with closing(Simulation(load_bundle(bundle, world))) as simulation:
        server = SimulationServer(simulation, MemoryMiddleware(bus, "simulator"))
        bus.every(0.001, server.cycle)
        name = "inverse_kinematics"
        plugin = generate(load(CONFIG, name), MemoryMiddleware(bus, name), Registry().find(name))
        bus.every(PERIOD, plugin.cycle)
        bus.run_until(3.0)
        robot, component = plugin.robot, plugin.component
        starts = {hand: component.references.targets[hand].task.point.value.copy() for hand in HANDS}
        robot.kinematics.update(robot.state.position)
        center, errors, shifts = robot.kinematics.center_of_mass.copy(), [], []
        for cycle in range(round(TURN / PERIOD)):
            for hand, start in starts.items():
                component.references.targets[hand].request(circle(start, cycle * PERIOD), stream=True)
            bus.run_until(bus.time + PERIOD)
            robot.kinematics.update(robot.state.position)
            for hand, link in HANDS.items():
                errors.append(np.linalg.norm(robot.kinematics.position(link) - circle(starts[hand], cycle * PERIOD)))
            shifts.append(np.linalg.norm(robot.kinematics.center_of_mass - center))
    yield Figure(f"{what}, RMS of the hands", rms(errors), "m", 5e-3)
    yield Figure(f"{what}, shift of the centre of mass", float(max(shifts)), "m", 5e-3)


def rms(errors: list[float]) -> float:
    """Compute the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(errors))))


def out_of_reach(seed: int, directions: int) -> Iterator[Figure]:
    """Desire a hand, or every third time both, 1 m farther than they can reach, in drawn directions."""
    rng, warnings, robot = np.random.default_rng(seed), Warnings(), upper_body()
    logger = logging.getLogger("solfer.components")
    logger.addHandler(warnings)
    component, model, start = component_of(robot, "manipulation"), robot.twin(), robot.state.position.copy()
    fastest, beyond, messages = 0.0, 0.0, []
    for direction in range(directions):
        robot.state.position[:] = start
        component.init()
        before, hands = len(warnings.messages), (("left",), ("right",), tuple(HANDS))[direction % 3]
        for hand in hands:
            way, shoulder = rng.normal(size=3), HANDS[hand].replace("7", "2")
            center = robot.kinematics.position(shoulder) - robot.kinematics.position("pelvis")
            component.references.targets[hand].request(center + (1.0 + 0.8) * way / np.linalg.norm(way))
        last, places = robot.command.position.copy(), []
        for cycle in range(round(4.0 / PERIOD)):
            component.update()
            component.send()
            speed = np.abs(robot.command.position - last) / PERIOD / robot.kinematics.velocity_limit
            beyond, last = max(beyond, float(speed.max())), robot.command.position.copy()
            if cycle * PERIOD > 3.0:
                model.kinematics.update(last)
                places.append([model.kinematics.position(HANDS[hand]).copy() for hand in hands])
        speeds = np.linalg.norm(np.diff(places, axis=0), axis=2) / PERIOD
        fastest = max(fastest, float(speeds.max()))
        said = warnings.messages[before:]
        messages += [sum(f"'{hand}'" in message for message in said) for hand in hands]
        if speeds.max() > 1e-4:
            print(f"direction {direction} ({', '.join(hands)}): {speeds.max():.3g} m/s", file=sys.stderr, flush=True)
    logger.removeHandler(warnings)
    what = f"out of reach, {directions} directions"
    yield Figure(f"{what}, speed of a hand after 3 s", fastest, "m/s", 1e-4)
    yield Figure(f"{what}, speed of a joint by its limit", beyond, "1", 1.0 + 1e-9)
    yield Figure(f"{what}, messages, most", max(messages), "1", 1)
    yield Figure(f"{what}, messages, fewest", min(messages), "1", 1, True)


def anywhere(seed: int, targets: int) -> Iterator[Figure]:
    """Move both hands to drawn targets, for 3 s each, through singularities and the ends of joints."""
    rng, robot = np.random.default_rng(seed), upper_body()
    component, model, limits = component_of(robot, "manipulation"), robot.twin(), robot.kinematics
    last, beyond, step, nearest = robot.command.position.copy(), -np.inf, 0.0, np.inf
    for target in range(targets):
        if target % 20 == 0:
            print(f"target {target}", file=sys.stderr, flush=True)
        for name, side in (("left", 0.2), ("right", -0.2)):
            component.references.targets[name].request((0.3, side, 0.2) + rng.uniform(-1.0, 1.0, 3))
        for _ in range(round(3.0 / PERIOD)):
            component.update()
            component.send()
            position = robot.command.position
            outside = np.maximum(limits.lower_position - position, position - limits.upper_position)
            beyond = max(beyond, float(outside.max()))
            step = max(step, float((np.abs(position - last) / (limits.velocity_limit * PERIOD)).max()))
            last = position.copy()
            model.kinematics.update(position)
            apart = model.kinematics.position(HANDS["left"]) - model.kinematics.position(HANDS["right"])
            nearest = min(nearest, float(np.linalg.norm(apart)))
    yield Figure(f"{targets} targets, beyond the range of a joint", beyond, "rad", 0.0)
    yield Figure(f"{targets} targets, step by speed limit x period", step, "1", 1.0 + 1e-9)
    yield Figure(f"{targets} targets, hands apart", nearest, "m", 0.05, True)


def cycle_times(calls: int) -> Iterator[Figure]:
    """Measure a cycle with centre of mass and two hands, with kinematics, in u."""
    robot = Robot.load(URDF)
    for index, dof in enumerate(robot.dofs):
        robot.state.position[index] = sum(angle for part, angle in NOMINAL.items() if part in dof)
    center, *hands = three_levels(robot)
    for name, solver, goal in (
        ("null spaces", Hierarchy([center, hands]), 0.8),
        ("QP with limits", QpHierarchy([[center, *hands]], joint_bounds(robot, PERIOD)), 4.0),
    ):
        yield Figure(f"cycle, centre of mass and hands, {name}", timed(robot, solver.update, calls), "u", goal)
    for what, kind, cycle, move in stacks():
        if (what, kind) == (STACKS["centauro"], "QPs"):
            yield Figure(f"cycle, {what}", in_units(cycle, calls, move), "u", 10.0)


def cycle_of_the_component(calls: int) -> Iterator[Figure]:
    """Measure a whole cycle of the component with centre of mass and two hands, in u; no goal is set for it."""
    robot = standing(Robot.load(URDF, SRDF, contacts=CONTACTS))
    component, time = component_of(robot, "inverse_kinematics"), 0.0
    starts = {name: component.references.targets[name].task.point.value.copy() for name in HANDS}

    def move() -> None:
        nonlocal time
        time += PERIOD
        robot.state.position[:] = robot.command.position
        for name, start in starts.items():
            port = component.references.targets[name].port
            port.value[:], port.fresh = circle(start, time), True

    def cycle() -> None:
        component.update()
        component.send()

    yield Figure("cycle of the component, whole body", in_units(cycle, calls, move), "u", None)


def timed(robot: Robot, update: Callable[[], object], calls: int) -> float:
    """Measure a cycle that begins with the kinematics, in u."""
    rng = np.random.default_rng(0)

    def move() -> None:
        robot.state.position[:] += rng.normal(scale=1e-4, size=robot.size)

    def cycle() -> None:
        robot.update()
        update()

    return in_units(cycle, calls, move)


def main() -> int:
    """Print all figures; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="one JSON object a line")
    parser.add_argument("--seed", type=int, default=0, help="of targets and directions")
    parser.add_argument("--targets", type=int, default=200, help="targets that are drawn")
    parser.add_argument("--directions", type=int, default=30, help="directions that are drawn")
    parser.add_argument("--calls", type=int, default=2000, help="calls that are timed")
    parser.add_argument("--postures", type=int, default=10, help="postures in which a hand is pushed aside")
    parser.add_argument("--only", help="the cases whose names begin with this")
    options = parser.parse_args()
    cases: tuple[tuple[str, Callable[[], Iterator[Figure]]], ...] = (
        ("cycles", lambda: cycle_times(options.calls)),
        ("component", lambda: cycle_of_the_component(options.calls)),
        ("circles, model", circles_in_the_model),
        ("circles, simulation", circles_in_simulation),
        ("circles, masses", lambda: (each for seed in range(1, 4) for each in circles_in_simulation(seed))),
        ("out of reach", lambda: out_of_reach(options.seed, options.directions)),
        ("anywhere", lambda: anywhere(options.seed, options.targets)),
        ("compensation", lambda: (Figure(*each) for each in compensation.rows(options.postures, options.calls))),
    )
    if not any(name.startswith(options.only or "") for name, _ in cases):
        parser.error(f"no case begins with '{options.only}'; expected: {', '.join(name for name, _ in cases)}")
    met = True
    for name, figures in cases:
        if not name.startswith(options.only or ""):
            continue
        print(name, file=sys.stderr, flush=True)
        for figure in figures():
            met = met and figure.met
            line = {**figure._asdict(), "met": figure.met}
            del line["at_least"]
            goal = "" if figure.goal is None else f" goal {figure.goal:g}"
            text = f"{figure.case:58} {figure.value:12.6g} {figure.unit:4}{goal}"
            print(json.dumps(line) if options.json else text + ("" if figure.met else "  NOT MET"), flush=True)
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())

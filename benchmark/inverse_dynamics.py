#!/usr/bin/env python3
"""What inverse dynamics reaches on robots with wheels, soles and points: squats, pushes, and the time of a cycle.

Run with `./run exec python benchmark/inverse_dynamics.py [--json] [--seed N] [--only CASES]`. Each figure is a line,
with `--json` an object with `case`, `value`, `unit`, `goal` and `met`. The exit code is 1 if a goal is not met. 1 u is
one `pinocchio.computeAllTerms` on CENTAURO in the same run; cycles are timed by the time of the processor, which other
work does not lengthen. Robots are pushed at their base, in directions that the seed draws, while their masses are up to
10 % wrong. TALOS and ANYmal come with `requirements-examples.txt`.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, redirect_stdout
from pathlib import Path

import numpy as np
import pinocchio
from manipulation import Figure
from points import ROOT
from support.integration.carried import with_other_masses
from support.integration.torque_robot import TorqueRobot
from support.integration.world import World, parameters, perfect

from solfer import Robot
from solfer.components import Component
from solfer.components.inverse_dynamics import InverseDynamics
from solfer.config import load
from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.bundle import load_bundle

WRONG, PUSH, REST = 0.1, 0.3, 2.0
"""Share of wrong masses, and times of a push and of the rest after it [s]."""

CASES = {"centauro": ("pelvis", 100.0), "talos": ("base_link", 40.0), "anymal": ("base", 100.0)}
"""Robots, with the link that is pushed and the force [N]."""


class HeavyWorld(World):
    """CENTAURO with masses that are not those of its model."""

    seed: int | None = None

    def offer(self, middleware):  # noqa: D102 see World
        text = parameters()["/robot_description"]
        urdf = text if self.seed is None else with_other_masses(text, WRONG, self.seed)
        simulation = Simulation(load_bundle(perfect(), urdf))
        return simulation, SimulationServer(simulation, middleware)


def started(name: str, amplitude: float, seed: int | None, folder: Path) -> tuple[TorqueRobot | World, Component]:
    """Start a robot that squats to each side by an amplitude [m]; with a seed its masses are wrong."""
    if name == "centauro":
        HeavyWorld.seed = seed
        world = HeavyWorld()
        world.run(0.5)
        return world, world.plugin("squat" if amplitude else "inverse_dynamics").component
    with redirect_stdout(sys.stderr):
        robot = TorqueRobot(name, folder, amplitude, None if seed is None else (WRONG, seed))
    return robot, robot.plugin.component


def squats(name: str, folder: Path) -> Iterator[Figure]:
    """Squat by 10 cm at 0.25 Hz for 20 s."""
    robot, component = started(name, 0.05, None, folder)
    with closing(robot):
        simulation, com = robot.simulation, component.tasks["com"]
        robot.run(0.5)
        errors, grips, shares = [], [], []
        limit = simulation.kinematics.effort_limit[6:]

        def look():
            errors.append(com.point.value - com.reference.value)
            forces = np.array(list(simulation.contacts().values()))
            grips.append(np.max(np.linalg.norm(forces[:, :2], axis=1) / forces[:, 2]))
            shares.append(np.max(np.abs(simulation.torque[6:]) / limit))

        robot.bus.every(0.005, look)
        robot.run(20.0)
    rms = 1e3 * float(np.sqrt(np.mean(np.sum(np.square(errors), axis=1))))
    yield Figure(f"squat {name}: centre of mass, RMS", rms, "mm", 5.0)
    yield Figure(f"squat {name}: largest share of friction", float(max(grips)), "", 0.8 if name == "centauro" else 0.7)
    yield Figure(f"squat {name}: largest share of a torque limit", float(max(shares)), "", 1.0)


def pushes(name: str, seed: int, folder: Path) -> Iterator[Figure]:
    """Push in 8 directions, and wait for 2 s."""
    robot, component = started(name, 0.0 if name == "centauro" else 1e-9, seed, folder)
    link, force = CASES[name]
    with closing(robot):
        com, away, left = component.tasks["com"], 0.0, 0.0
        robot.run(1.5)
        for angle in np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 8):
            before = com.point.value.copy()
            push = force * np.array((np.cos(angle), np.sin(angle), 0.0))
            robot.simulation.pushes.add(link, push, (0.0, 0.0, 0.0), PUSH)
            robot.run(PUSH)
            away = max(away, float(np.linalg.norm(com.point.value - before)))
            robot.run(REST)
            left = max(left, float(np.linalg.norm(com.point.value - before)))
        tilt = float(np.abs(robot.simulation.q[3:5]).max())
    yield Figure(f"pushes {name}: way at the end of {force:g} N", 1e3 * away, "mm", None)
    yield Figure(f"pushes {name}: way 2 s later", 1e3 * left, "mm", 10.0)
    yield Figure(f"pushes {name}: tilt in the end", tilt, "rad", 0.1)


def cycles(seed: int) -> Iterator[Figure]:
    """Measure a cycle of CENTAURO, kinematics and dynamics included, at states near the one in which it stands."""
    files = ROOT / "config/robots/centauro"
    robot = Robot.load(
        files / "centauro.urdf",
        files / "centauro.srdf",
        actuators=files / "actuators.yaml",
        contacts=files / "contacts.yaml",
        name="centauro",
    )
    indices, values = robot.named_state("mammal_wide_straight")
    robot.state.position[indices] = values
    robot.update()
    tags = load(ROOT / "config/centauro.yaml", "inverse_dynamics").tags(InverseDynamics.Tags)
    component, home = InverseDynamics(robot, tags), robot.state.position.copy()
    component.set_rate(200.0)
    component.start_position = home
    component.init()
    random = np.random.default_rng(seed)

    def move():
        robot.state.position[:] = home + random.uniform(-0.02, 0.02, robot.size)
        robot.state.velocity[:] = random.normal(0.0, 0.02, robot.size)

    def cycle():
        robot.update()
        robot.dynamics.update()
        component.update()
        component.send()

    model, data = robot.kinematics.pinocchio[0], robot.kinematics.pinocchio[0].createData()
    times, units = np.zeros((2, 2000))
    for index in range(len(times)):
        move()
        state = robot.state.position.copy(), robot.state.velocity.copy()
        start = time.thread_time()
        pinocchio.computeAllTerms(model, data, *state)
        between = time.thread_time()
        cycle()
        times[index], units[index] = time.thread_time() - between, between - start
    one = float(np.median(units))
    yield Figure("cycle centauro: p50", float(np.median(times)) / one, "u", 10.0)
    yield Figure("cycle centauro: p99", float(np.percentile(times, 99)) / one, "u", 20.0)


def figures(only: list[str], seed: int) -> Iterator[Figure]:
    """Yield the figures of the cases `squat`, `pushes` and `cycle`."""
    for name in CASES:
        for case in ("squat", "pushes"):
            if case in only:
                with tempfile.TemporaryDirectory() as folder:
                    yield from squats(name, Path(folder)) if case == "squat" else pushes(name, seed, Path(folder))
    if "cycle" in only:
        yield from cycles(seed)


def main() -> int:
    """Print all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one object a line")
    parser.add_argument("--seed", type=int, default=1, help="of directions and wrong masses (default: %(default)s)")
    parser.add_argument("--only", default="squat,pushes,cycle", help="cases, with commas (default: %(default)s)")
    arguments, is_met = parser.parse_args(), True
    for figure in figures(arguments.only.split(","), arguments.seed):
        is_met = is_met and figure.met
        if arguments.json:
            print(json.dumps(figure._asdict() | {"met": figure.met}), flush=True)
        else:
            goal = "" if figure.goal is None else f"   at most {figure.goal:g}"
            print(f"{figure.case:<52}{figure.value:9.3f} {figure.unit:<4}{goal}", flush=True)
    return 0 if is_met else 1


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""What inverse dynamics reaches on robots with wheels, soles and points: squats, pushes, and the time of a cycle.

Run with `./run exec python benchmark/inverse_dynamics.py [--json] [--seed N] [--only CASES] [--engine NAME]`. Each
figure is a line, with `--json` an object with `case`, `value`, `unit`, `goal` and `met`. The exit code is 1 if a goal
is not met. 1 u is one `pinocchio.computeAllTerms` on CENTAURO in the same run; cycles are timed by the time of the
processor, which other work does not lengthen. Robots are pushed at their base, in directions that the seed draws, while
their masses are up to 10 % wrong: with the seeds 1 to 3, or the one that is given. Robots with hands draw a circle with
one while they squat; CENTAURO does the same once more where odometry estimates its base. On slopes CENTAURO squats with
the normals of its file, and with those that odometry feels. TALOS and ANYmal come with `requirements-examples.txt`.
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
from form import add_engine
from manipulation import Figure
from points import ROOT
from support.integration.carried import with_other_masses
from support.integration.torque_robot import LEGGED, TorqueRobot, hand_task
from support.integration.world import CONFIG, ROBOT, World, parameters, perfect

from solfer import Robot
from solfer.components import Component
from solfer.components.inverse_dynamics import InverseDynamics
from solfer.config import load
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.bundle import load_bundle
from solfer.simulation.robot_body.placement import StartPlacement
from solfer.simulation.world.records import WorldRecord

SQUATS = {"go1": 0.03, "go2": 0.03}
"""Robots with short legs, and how far they squat to each side [m]; others by 0.05 m."""

WRONG, PUSH, REST = 0.1, 0.3, 2.0
"""Share of wrong masses, and times of a push and of the rest after it [s]."""

CASES = {
    "centauro": ("pelvis", 100.0),
    "talos": ("base_link", 40.0),
    "anymal": ("base", 100.0),
    "hyq": ("base_link", 100.0),
    "b1": ("base", 60.0),
    "go2": ("base", 25.0),
    "go1": ("base", 25.0),
}
"""Robots, with the link that is pushed and the force [N]."""

HANDS = {"centauro": "arm1_7", "talos": "arm_left_7_link"}
"""Links that draw a circle."""

STANDING = 1e-9
"""Amplitude of a robot that stands [m]; squats are larger."""

WAYS = {"ahead": 0.0, "across": 0.5 * np.pi}
"""Headings of a robot that stands on a slope [rad]."""

SEEDS = (1, 2, 3)
"""Seeds of pushes."""

SLOPES = [(degrees, way, base) for base in ("squat", "squat_estimated") for degrees in (10, 15) for way in WAYS]
"""Slopes [deg], in which direction they rise, and the plugin on the true base or on an estimated one."""


class HeavyWorld(World):
    """CENTAURO with perfect sensors, and with masses that are not those of its model."""

    seed: int | None = None
    slope = heading = 0.0  # [rad]

    def offer(self, middleware):  # noqa: D102 see World
        text = parameters()["/robot_description"]
        urdf = text if self.seed is None else with_other_masses(text, WRONG, self.seed)
        record = perfect() if self.is_perfect else read_bundle(ROBOT / "robot.yaml")
        world = WorldRecord.model_validate({"ground": {"slope": self.slope}})
        simulation = Simulation(load_bundle(record, urdf), world=world)
        simulation.reset(placement=StartPlacement(yaw=self.heading))
        return simulation, SimulationServer(simulation, middleware)


class SensedWorld(HeavyWorld):
    """The same with its sensors as they are shipped."""

    is_perfect = False


def configured(folder: Path, amplitude: float, hand: bool = True) -> Path:
    """Write CENTAURO's configuration with squats to each side by an amplitude [m]; a hand may draw a circle."""
    for name in ("support", "robots"):
        (folder / name).symlink_to(CONFIG / name)
    first, begin, squat = (CONFIG / "centauro.yaml").read_text().partition("    squat: &squat")
    squat = squat.replace("[0.0, 0.0, -0.05]", f"[0.0, 0.0, {-amplitude}]", 1)
    task = f"hand: {json.dumps(hand_task(HANDS['centauro'], 'pelvis'))}\n          base: "
    if hand and amplitude > STANDING:
        squat = squat.replace("base: ", task, 1).replace("[com, base]", "[com, base, hand]", 1)
    file = folder / "centauro.yaml"
    file.write_text(first + begin + squat)
    return file


def started(name: str, amplitude: float, seed: int | None, folder: Path) -> tuple[TorqueRobot | World, Component]:
    """Start a robot that squats to each side by an amplitude [m]; with a seed its masses are wrong."""
    if name in ("centauro", "estimated"):
        HeavyWorld.seed = seed
        world = HeavyWorld() if name == "centauro" else SensedWorld()
        world.run(1.0)
        if name == "centauro":
            return world, world.plugin("squat", configured(folder, amplitude)).component
        world.plugin("odometry", target="solfer.components.odometry:Odometry")
        world.run(0.5)
        return world, world.plugin("squat_estimated", configured(folder, amplitude)).component
    wrong = None if seed is None else (WRONG, seed)
    with redirect_stdout(sys.stderr):
        robot = TorqueRobot(name, folder, amplitude, wrong, HANDS.get(name) if amplitude > STANDING else None)
    return robot, robot.plugin.component


def squats(name: str, folder: Path) -> Iterator[Figure]:
    """Squat by 10 cm, with short legs by 6 cm, at 0.25 Hz for 20 s; a hand draws a circle meanwhile."""
    robot, component = started(name, SQUATS.get(name, 0.05), None, folder)
    with closing(robot):
        simulation, com, hand = robot.simulation, component.tasks["com"], component.tasks.get("hand")
        robot.run(0.5)
        model, _ = component.model.kinematics.pinocchio
        data = model.createData()
        known = "centauro" if name == "estimated" else name
        links = (CASES[known][0], HANDS[known]) if hand is not None else ()
        frames = [model.getFrameId(link) for link in links]
        errors, away, grips, shares, excesses = [], [], [], [], []
        limit = simulation.kinematics.effort_limit[6:]
        weight = component.model.kinematics.mass * 9.81

        def look():
            errors.append(pinocchio.centerOfMass(model, data, simulation.q) - com.reference.value)
            if hand is not None:
                base, tip = (pinocchio.updateFramePlacement(model, data, frame) for frame in frames)
                away.append(base.actInv(tip.translation) - hand.reference.value)
            forces = np.array(list(simulation.contacts().values()))
            grips.append(np.max(np.linalg.norm(forces[:, :2], axis=1) / forces[:, 2]))
            excesses.append(
                float(np.sum(component.ground.normals @ component.problem.force) - np.sum(forces[:, 2])) / weight
            )
            shares.append(np.max(np.abs(simulation.torque[6:]) / limit))

        robot.bus.every(0.005, look)
        robot.run(20.0)
        held = float(component.is_holding)
    bound = 10.0 if name == "estimated" else 5.0
    yield Figure(f"squat {name}: centre of mass, RMS", _rms(errors), "mm", bound)
    if hand is not None:
        yield Figure(f"squat {name}: circle of a hand, RMS", _rms(away), "mm", bound)
    yield Figure(f"squat {name}: forces beyond those of PyBullet", 1e2 * abs(float(np.mean(excesses))), "%", 1.0)
    yield Figure(f"squat {name}: largest share of friction", float(max(grips)), "", 0.7 if name in LEGGED else 0.8)
    yield Figure(f"squat {name}: largest share of a torque limit", float(max(shares)), "", 1.0)
    yield Figure(f"squat {name}: it holds instead", held, "", 0.0)


def slopes(degrees: float, way: str, name: str, is_felt: bool) -> Iterator[Figure]:
    """Squat on a slope by 10 cm, at 0.25 Hz for 4 s."""
    kind = type("Sloped", (HeavyWorld if name == "squat" else SensedWorld,), {})
    kind.slope, kind.heading, kind.seed = np.radians(degrees), WAYS[way], None
    normal = np.array((-np.sin(kind.slope), 0.0, np.cos(kind.slope)))
    with closing(kind()) as world, tempfile.TemporaryDirectory() as folder:
        file = configured(Path(folder), 0.05, hand=False)
        ground = "      ground: odometry/ground"
        text = file.read_text().replace(ground, "      #")
        driven = "      speed_driven: wheels"
        file.write_text(text.replace(driven, f"{ground}\n{driven}", 1) if is_felt else text)
        world.run(1.0)
        odometry = world.plugin("odometry", target="solfer.components.odometry:Odometry")
        world.run(0.6)
        simulation = world.simulation
        away = simulation.q[:3] - odometry.robot.command.position[:3] if name == "squat_estimated" else 0.0
        component = world.plugin(name, file).component
        world.run(0.5)
        com = component.tasks["com"]
        model, _ = component.model.kinematics.pinocchio
        data = model.createData()
        errors, grips, planned, slips = [], [], [], []

        def ratio(forces):
            pressed = forces @ normal
            return float(np.max(np.linalg.norm(forces - np.outer(pressed, normal), axis=1) / pressed))

        def look():
            errors.append(pinocchio.centerOfMass(model, data, simulation.q) - away - com.reference.value)
            grips.append(ratio(np.array(list(simulation.contacts().values()))))
            planned.append(ratio(component.problem.force.reshape(-1, 3)))
            slips.append(float(np.abs(component._watch._moved).max()))

        world.bus.every(0.005, look)
        world.run(4.0)
        held = float(component.is_holding)
    case = f"{name} on {degrees} deg {way}, {'felt' if is_felt else 'not felt'}"
    goals = (5.0, 0.8, 0.8, 5.0, 0.0) if is_felt else (None,) * 5
    yield Figure(f"{case}: centre of mass, RMS", _rms(errors), "mm", goals[0])
    yield Figure(f"{case}: largest share of friction", max(grips), "", goals[1])
    yield Figure(f"{case}: the same, as planned", max(planned), "", goals[2])
    yield Figure(f"{case}: a contact moves, within 0.5 s", 1e3 * max(slips), "mm", goals[3])
    yield Figure(f"{case}: it holds instead", held, "", goals[4])


def _rms(errors: list[np.ndarray]) -> float:
    return 1e3 * float(np.sqrt(np.mean(np.sum(np.square(errors), axis=1))))


def pushes(name: str, seed: int, folder: Path) -> Iterator[Figure]:
    """Push in 8 directions, and wait for 2 s."""
    robot, component = started(name, STANDING, seed, folder)
    link, force = CASES["centauro" if name == "estimated" else name]
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
    yield Figure(f"pushes {name}, seed {seed}: way at the end of {force:g} N", 1e3 * away, "mm", None)
    yield Figure(f"pushes {name}, seed {seed}: way 2 s later", 1e3 * left, "mm", 20.0 if name == "estimated" else 10.0)
    yield Figure(f"pushes {name}, seed {seed}: tilt in the end", tilt, "rad", 0.1)


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


def figures(only: list[str], seeds: tuple[int, ...]) -> Iterator[Figure]:
    """Yield the figures of the cases `squat`, `slope`, `pushes` and `cycle`."""
    for name in (*CASES, "estimated"):
        if "squat" in only:
            with tempfile.TemporaryDirectory() as folder:
                yield from squats(name, Path(folder))
    for case in SLOPES if "slope" in only else ():
        for is_felt in (False, True):
            yield from slopes(*case, is_felt)
    for name in (*CASES, "estimated"):
        for seed in seeds if "pushes" in only else ():
            with tempfile.TemporaryDirectory() as folder:
                yield from pushes(name, seed, Path(folder))
    if "cycle" in only:
        yield from cycles(seeds[0])


def main() -> int:
    """Print all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one object a line")
    parser.add_argument("--seed", type=int, help="of directions and wrong masses (default: 1, 2 and 3 in turn)")
    parser.add_argument("--only", default="squat,slope,pushes,cycle", help="cases, with commas (default: %(default)s)")
    add_engine(parser)
    arguments, is_met = parser.parse_args(), True
    seeds = SEEDS if arguments.seed is None else (arguments.seed,)
    for figure in figures(arguments.only.split(","), seeds):
        is_met = is_met and figure.met
        if arguments.json:
            print(json.dumps(figure._asdict() | {"met": figure.met}), flush=True)
        else:
            goal = "" if figure.goal is None else f"   at most {figure.goal:g}"
            print(f"{figure.case:<52}{figure.value:9.3f} {figure.unit:<4}{goal}", flush=True)
    return 0 if is_met else 1


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""How well odometry knows where CENTAURO is, and ground forces what carries it, on courses with sensors that err.

Run with `./run exec python benchmark/estimation.py [--json] [--course NAME...] [--seed N] [--noise K] [--draws D]
[--world FILE] [--engine NAME] [--transport FILE] [--method NAME...] [--normalised] [--logs DIR] [--jobs N] [--picture
FILE]`. A course is one of `estimation_cases/courses.py` or a YAML file with `legs: [{x: 4.5}, {turn: 3.14}, {y: 1.0}]`;
the robot follows it by where it truly is, in PyBullet, faster than real time. Once for each course and seed a log is
written of what joints, base and ground do; with `--logs` it is kept, and used again. Sensors of a seed measure it with
the errors of `config/robots/centauro/robot.yaml`, times K (1 and 3), a cycle late, and radii of the wheels that differ
by up to 0.3 percent times K. All methods see the same measurements; with `--draws` sensors measure a log D times. With
`--transport` a file of faults, such as `config/transport/busy.yaml`, is between them and all methods, and the loops of
these leave cycles out. Methods are those of `odometry`, of which `geometric` is the paper's, and two from the
literature: `rolling_squares` and `point_contacts`. `smoother` knows past and future of a log on level ground; beside it
a line has the ratios of the RMS errors of `filter` to its own. `--normalised` prints the means over all draws of the
squared errors of `filter` by its covariances instead, which are 1 where these are right. With `--json` each line is an
object; progress is on stderr. The exit code is 1 if `filter` misses a goal at the shipped noise.
"""

import argparse
import json
import logging
import math
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from estimation_cases.courses import COURSES, DRAWN, Course, course, read_course
from estimation_cases.driver import drive
from estimation_cases.log import Log
from estimation_cases.methods import require_topics
from estimation_cases.picture import draw
from estimation_cases.play import METHODS, Played
from estimation_cases.summaries import mean_normalised, ratios
from form import add_engine

from solfer.errors import SolferError
from solfer.middleware.memory import read_faults
from solfer.simulation.engines import default_engine
from solfer.simulation.world.world import read_world
from solfer.supervision import supervise

SHIPPED = ("loop", "drawn", "patch", "lifted", "ridge")
CAUSAL = tuple(name for name in METHODS if name != "smoother")
SEEDS, NOISES = (1, 2, 3, 4, 5), (1.0, 3.0)
NEXT_DRAW = 1000
"""Difference of the seeds of sensors that measure one log."""


class Task(NamedTuple):
    """A course, the seed of its log, and what is measured of it."""

    name: str
    seed: int
    world: Path | None
    noises: tuple[float, ...]
    draws: int
    methods: tuple[str, ...]
    logs: Path
    picture: Path | None
    transport: Path | None = None


def run(task: Task) -> list[dict[str, Any]]:
    """Drive along a course, unless there is a log of it, and return a line for each method, draw and noise."""
    chosen, stem = course_of(task.name, task.seed), Path(task.name).stem
    if task.world is not None:
        chosen, stem = chosen._replace(world=task.world), f"{stem}-{task.world.stem}"
    if default_engine() != "bullet":
        stem = f"{stem}-{default_engine()}"
    path, lines = task.logs / f"{stem}-{task.seed}.npz", []
    if not path.is_file():
        print(f"{stem}, seed {task.seed}: drives", file=sys.stderr, flush=True)
        drive(chosen, task.seed).save(path)
    log = Log.load(path)
    faults = None if task.transport is None else read_faults(task.transport)
    for noise in task.noises:
        for draw_index in range(task.draws):
            seed = task.seed + NEXT_DRAW * draw_index
            print(f"{stem}, seed {seed}, noise {noise:g}: estimates", file=sys.stderr, flush=True)
            played = Played(log, seed, noise, task.methods, faults)
            if task.picture is not None:
                draw(task.picture, played.truth, played.estimates)
            for method, figures in played.figures.items():
                rounded = {key: round(value, 6) for key, value in figures.items()}
                lines.append({"course": stem, "method": method, "seed": seed, "noise": noise} | rounded)
                if task.transport is not None:
                    lines[-1]["transport"] = task.transport.stem
                lines[-1]["missed"] = missed(lines[-1], chosen)
    return lines


def course_of(name: str, seed: int) -> Course:
    """Return a course by its name or of a file."""
    return read_course(Path(name)) if is_file(name) else course(name, seed)


def is_file(name: str) -> bool:
    """Whether a course is a file."""
    return name.endswith((".yaml", ".yml"))


def missed(line: dict[str, Any], chosen: Course) -> list[str]:
    """Return the figures of the filter that miss their goals, which are those of the shipped noise."""
    if line["method"] != "filter" or line["noise"] != 1.0:
        return []
    return [key for key, most in chosen.goals.items() if not line[key] <= most]


def required(parser: argparse.ArgumentParser, given: argparse.Namespace) -> None:
    """End with an error, exit code 2, if an option has a value that cannot be used."""
    try:
        for name in given.course:
            if is_file(name):
                read_course(Path(name))
            elif name not in (*COURSES, *DRAWN):
                parser.error(
                    f"there is no course '{name}'; there are {', '.join((*COURSES, *DRAWN))}, and files (*.yaml)"
                )
        if given.world is not None:
            read_world(given.world)
        if given.transport is not None:
            require_topics(read_faults(given.transport))
    except SolferError as error:
        parser.error(str(error))
    if given.seed is not None and not 0 <= given.seed < 2**31:
        parser.error(f"the seed is {given.seed}, expected from 0 to {2**31 - 1}")
    if given.noise is not None and not (math.isfinite(given.noise) and given.noise >= 0.0):
        parser.error(f"the noise is {given.noise:g}, expected a finite number of zero or more")
    for name in ("draws", "jobs"):
        if getattr(given, name) < 1:
            parser.error(f"{name} is {getattr(given, name)}, expected one or more")
    if given.logs is not None and given.logs.exists() and not given.logs.is_dir():
        parser.error(f"{given.logs} is not a folder")


def lines_of(tasks: list[Task], jobs: int) -> Iterator[list[dict[str, Any]]]:
    """Yield the lines of each task in their order."""
    if jobs == 1:
        yield from map(run, tasks)
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(run, tasks)


def main() -> int:
    """Print all figures, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--json", action="store_true", help="an object for each line")
    parser.add_argument("--course", nargs="+", default=SHIPPED, metavar="NAME", help=", ".join((*COURSES, *DRAWN)))
    parser.add_argument("--seed", type=int, help="one seed; default: 1 to 5")
    parser.add_argument("--noise", type=float, help="factor of all errors; default: 1 and 3")
    parser.add_argument("--draws", type=int, default=1, help="how often sensors measure each log, of other seeds")
    parser.add_argument("--world", type=Path, help="file of the world; default: that of the course")
    add_engine(parser)
    parser.add_argument("--transport", type=Path, metavar="FILE", help="faults between sensors and methods")
    parser.add_argument("--method", nargs="+", choices=METHODS, default=CAUSAL, help="default: all but smoother")
    parser.add_argument("--normalised", action="store_true", help="means over all draws of normalised squared errors")
    parser.add_argument("--logs", type=Path, metavar="DIR", help="folder in which logs are kept")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="draw the paths of the last one into a PNG file")
    given = parser.parse_args()
    required(parser, given)
    seeds = SEEDS if given.seed is None else (given.seed,)
    noises = NOISES if given.noise is None else (given.noise,)
    methods = tuple(dict.fromkeys(("filter", *given.method)))
    is_missed = False
    with tempfile.TemporaryDirectory() as folder:
        logs = given.logs or Path(folder)
        logs.mkdir(parents=True, exist_ok=True)
        tasks = [
            Task(name, seed, given.world, noises, given.draws, methods, logs, given.picture, given.transport)
            for name in given.course
            for seed in seeds
        ]
        for lines in lines_of(tasks, given.jobs):
            for line in lines:
                failed = line.pop("missed")
                is_missed = is_missed or bool(failed)
                if failed:
                    print(f"{line['course']}, seed {line['seed']}: {', '.join(failed)} above the goal", file=sys.stderr)
            for line in mean_normalised(lines) if given.normalised else lines + ratios(lines):
                show(line, given.json)
    return int(is_missed)


def show(line: dict[str, Any], as_json: bool) -> None:
    """Print a line."""
    print(json.dumps(line) if as_json else "  ".join(f"{key} {each}" for key, each in line.items()), flush=True)


if __name__ == "__main__":
    supervise()
    logging.disable(logging.WARNING)  # of robots that slip on purpose
    sys.exit(main())

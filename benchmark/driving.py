#!/usr/bin/env python3
"""How well `wheeled_motion` drives a robot in PyBullet, and how near it is to the original's recorded motions.

Run with `./run exec python benchmark/driving.py [COURSE...] [--json] [--seed N] [--count M] [--world FILE] [--engine
NAME] [--robot FILE] [--transport FILE] [--estimated] [--model] [--jobs N]`. A course is one of
`driving_cases/courses.py`, `mixed`, which the seed draws, or a scenario file, which is played from where the robot is;
default: all of the first. The robot is CENTAURO unless a file names another one. Plugins and PyBullet run in memory,
faster than real time; progress is on stderr. A line has

- `done`, `toppled`: whether the robot came to the course's end on its wheels, near its references;
- `com_rms`, `vertex_rms`, `heading_rms`: errors of base and vertices [m, rad], vertices seen from the pelvis' heading;
- `height_rms`: error of the pelvis' height [m];
- of a scenario `goal_base`, `goal_heading`, `goal_vertex`: distances at the end from what the file says [m, rad];
- `lag` [s], `duration` as a share of the course's own;
- `slip`: way that the wheels' material slid over the ground, by the way of their centres;
- `margin` of the centre of mass in the support polygon [m], largest `joint_error` [rad] and `torque` (by its limit);
- `cost_of_transport`, `held_back`: command values that the plugin's gate changed, `cycle_p50`, `cycle_p99` [us];
- `holds`: what the robot rests at, if it is not done;
- `drift`: how far the estimate of the base went astray [m], which does not count in the errors.

With a seed, masses and inertias of all links are wrong by 20 %, centres of mass by 20 mm, joints are measured 3 ms
late, and friction is between 0.4 and 1; 0 is the nominal robot. With `--count M` each course is driven with M seeds,
N and the following ones; the last line then has mean, largest and least of each number. The exit code is 1 if one is
not done.

With `--estimated` the base is that of the odometry, and sensors err as in the robot's file; they are perfect otherwise.

`--transport` puts the faults of a file, such as `config/transport/busy.yaml`, between PyBullet and the plugins, and
lets the loops of these leave cycles out.

`--model` drives in the model alone, where the robot does what is commanded. Then `lost` is the time [s] that the course
loses by each cause: `speeds` that are larger than they may be, `wheels` that have to turn first, `joints` at their
bounds and what else holds a motion, the acceleration when it goes on (`start`), and wheels that are lifted (`lift`).

`--pushes PICTURE` pushes the robot that stands, at the pelvis for 0.2 s in eight directions, until it tips over, with
and without the tag `reactive` of `support_shaping`; the polar plot of the largest impulses is the picture.

`--golden FILE...` compares recorded motions of the original program instead, open loop. A file is a recorded motion in
JSON, gzipped or not: `dt`, `cycles`, `record_every`, `dof_names`, `q0`, `columns` and `rows`; where its folder has
`ref_NAME.txt.gz` for a file that ends with `NAME`, references are those (100 Hz: velocities of vertices and base, rate
of the heading, camber). The measured state of each cycle is what was commanded in the one before. For each file: the
RMS and the largest difference of a joint [rad], and the time until which it is below 1e-6 rad [s]. The exit code is 1
if a file differs more. `--law` adds `law_max`, the largest difference [rad] of the original's equations in plain NumPy,
`driving_cases/original.py`, which compute the motion without the component.

`--cycle` measures what one cycle costs, the update of the Robot with it, in the model alone: `cycle_p50` and
`cycle_p99` [us], `cycle_p50_u` in u, which is one `pinocchio.computeAllTerms` on the same robot in the same run, and
the median of each of its stages [us].
"""

import argparse
import json
import logging
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from driving_cases.courses import COURSES, Part, mixed
from driving_cases.cycles import cycles
from driving_cases.drive import drive
from driving_cases.driven import driven
from driving_cases.errors import wrong_robot
from driving_cases.golden import compare
from driving_cases.model import drive_model
from driving_cases.pushes import compare as compare_pushes
from form import add_engine

from solfer.errors import SolferError, SolferErrors, UnknownName
from solfer.middleware.memory import read_faults
from solfer.supervision import supervise
from solfer_tools.scenarios import Scenario, read_scenario


def run(name: str, seed: int, options: dict[str, Any]) -> dict[str, Any]:
    """Drive along a course by its name; return the figures."""
    logging.disable(logging.WARNING)
    print(f"{name}, seed {seed}", file=sys.stderr, flush=True)
    course: tuple[Part, ...] | Scenario
    if is_file(name):
        name, course = Path(name).stem, read_scenario(name)
    else:
        course = mixed(seed) if name == "mixed" else COURSES[name]
    if "is_estimated" in options:
        options = options | wrong_robot(seed, driven(options["robot"]).urdf)
        try:
            return drive(name, course, seed, **options)
        except (UnknownName, SolferErrors) as error:
            raise SolferError(str(error)) from None  # which other processes can read
    return drive_model(name, course, seed, **options)


def summary(lines: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the mean and the largest of each number, and how many drives were done."""
    found: dict[str, Any] = {"scenario": "all", "drives": len(lines), "done": sum(line["done"] for line in lines)}
    for key in lines[0]:
        values = [line[key] for line in lines if isinstance(line.get(key), float)]
        if values:
            found[key] = {"mean": round(sum(values) / len(values), 6), "largest": max(values), "least": min(values)}
    return found


def as_text(line: dict[str, Any], is_json: bool) -> str:
    """Return figures as one line."""
    return json.dumps(line) if is_json else "  ".join(f"{key} {each}" for key, each in line.items())


def is_file(name: str) -> bool:
    """Whether a course is a scenario file."""
    return name.endswith((".yaml", ".yml"))


def require(name: str, wheels: int, parser: argparse.ArgumentParser) -> None:
    """End with an error if there is no such course for a number of wheels."""
    if not is_file(name) and name not in (*COURSES, "mixed"):
        parser.error(f"there is no course '{name}'; there are {', '.join(COURSES)}, mixed, and scenario files (*.yaml)")
    if not is_file(name):
        return
    try:
        legs = read_scenario(name).legs
    except SolferError as error:
        parser.error(str(error))
    if legs != wheels:
        parser.error(f"{name}: {legs} legs, expected {wheels}")


def require_transport(given: argparse.Namespace, parser: argparse.ArgumentParser) -> None:
    """End with an error if the file of faults cannot be used, or nothing of what is asked for has a transport."""
    if given.pushes or given.cycle or given.golden or given.model:
        parser.error("--transport is for courses in PyBullet")
    try:
        read_faults(given.transport)
    except SolferError as error:
        parser.error(str(error))


def main() -> int:
    """Run what the command line asks for; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("courses", nargs="*", metavar="COURSE", help=f"{', '.join(COURSES)}, mixed, or a file")
    parser.add_argument("--seed", type=int, default=0, help="of errors of the robot, and of `mixed`; 0: no errors")
    parser.add_argument("--count", type=int, default=1, help="of seeds, from that one on")
    parser.add_argument("--world", help="file of the world; default: a plane")
    add_engine(parser)
    parser.add_argument("--robot", type=Path, help="robot.yaml of another robot, with plugins.yaml beside it")
    parser.add_argument("--transport", type=Path, metavar="FILE", help="faults between simulator and plugins")
    parser.add_argument("--estimated", action="store_true", help="with the base of odometry and sensors that err")
    parser.add_argument("--model", action="store_true", help="in the model alone, without physics")
    parser.add_argument("--lower-body", action="store_true", help="on a Robot of the legs alone, by the pelvis")
    parser.add_argument("--tags", default="", help="tags that differ from the shipped ones, such as 'rest: false'")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--golden", nargs="+", type=Path, metavar="FILE", help="recorded motions")
    parser.add_argument("--law", action="store_true", help="with --golden, compare the plain law, too")
    parser.add_argument("--cycle", action="store_true", help="what one cycle costs")
    parser.add_argument("--calls", type=int, default=5000, help="cycles that are timed by --cycle")
    parser.add_argument("--json", action="store_true", help="print one object a line")
    parser.add_argument(
        "--pushes", type=Path, metavar="PICTURE", help="push the robot instead, and draw what it survives"
    )
    given = parser.parse_args()
    logging.disable(logging.WARNING)
    if given.transport:
        require_transport(given, parser)
    if given.pushes:
        options = {"is_estimated": given.estimated, "world": given.world}
        return 0 if compare_pushes(given.pushes, given.tags, given.seed, **options) else 1
    if given.cycle:
        for line in cycles(given.calls):
            print(as_text(line, given.json), flush=True)
        return 0
    if given.golden:
        for file in given.golden:
            if not file.is_file():
                parser.error(f"there is no file '{file}'")
        return 0 if compare(given.golden, given.json, given.law) else 1
    names = given.courses or list(COURSES)
    try:
        wheels = len(driven(given.robot).wheels)
    except SolferError as error:
        parser.error(str(error))
    for name in names:
        require(name, wheels, parser)
    if given.model and (given.world or given.estimated):
        parser.error("--model has no world, and its base is the true one")
    base = "link" if given.lower_body else "center_of_mass"
    options = {
        "tags": ", ".join(filter(None, (f"base: {base}", given.tags))),
        "is_whole": not given.lower_body,
        "robot": given.robot,
    }
    if not given.model:
        options |= {"is_estimated": given.estimated, "world": given.world, "transport": given.transport}
    drives = [(name, given.seed + more, options) for name in names for more in range(given.count)]
    lines = []
    try:
        with ProcessPoolExecutor(given.jobs) as pool:
            for line in pool.map(run, *zip(*drives, strict=True)):
                lines.append(line)
                print(as_text(line, given.json), flush=True)
    except SolferError as error:
        parser.error(str(error))
    if given.count > 1:
        print(as_text(summary(lines), given.json), flush=True)
    return 0 if all(line["done"] for line in lines) else 1


if __name__ == "__main__":
    supervise()
    sys.exit(main())

#!/usr/bin/env python3
"""How CENTAURO drives on slopes in all directions, and on uneven ground: a table of short drives by `wheeled_motion`.

Run with `./run exec python benchmark/slopes.py [CASE...] [--slopes DEGREES...] [--level] [--estimated] [--seed N]
[--engine NAME] [--transport FILE] [--jobs N] [--json]`. A case is one of CASES; default: all. In each one the robot
begins on level ground, but on `uneven`, where it begins on waves of 1 to 3 cm that the seeds 1 to 3 draw. In the table
are the largest error of a vertex and of the height above the ground [mm]; the smallest margin of the centre of mass in
the support polygon [m]; the largest tilt of the pelvis from its tilt at the start, and that at the end [deg]; the
duration as a ratio to that of the references; and what it rests at if it was not done: then the exit code is 1.
`--level` asks for a level pelvis (`tunning: level`); `--seed` draws a wrong robot, and with `--estimated` the base is
that of the odometry, as of `benchmark/driving.py`.
"""

import logging
import math
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from driving_cases.courses import Part
from driving_cases.drive import drive
from driving_cases.driven import driven
from driving_cases.errors import wrong_robot
from form import Figures, add_engine, parser_of

from solfer.supervision import supervise

FOLD = 0.6
"""Distance from the start at which the slope begins [m]."""

UP = Part(8.5, 0.2)
QUARTER = math.pi / 2.0 / 0.3
"""Duration of a quarter of a turn at 0.3 rad/s [s]."""

CASES: dict[str, tuple[float, tuple[Part, ...]]] = {
    "up": (0.0, (Part(10.0, 0.2),)),
    "down": (0.0, (Part(10.0, 0.2),)),
    "back": (180.0, (Part(10.0, -0.2),)),
    "diagonal": (45.0, (Part(10.0, 0.2),)),
    "diagonal_down": (-45.0, (Part(10.0, 0.2),)),
    "crab": (0.0, (UP, Part(4.0, y=0.1))),
    "across_left": (0.0, (UP, Part(QUARTER, turn=0.3), Part(4.0, 0.15))),
    "across_right": (0.0, (UP, Part(QUARTER, turn=-0.3), Part(4.0, 0.15))),
    "arc": (0.0, (UP, Part(7.0, 0.1, turn=0.3))),
    "uneven": (0.0, (Part(6.0, 0.2), Part(5.0, 0.15, turn=0.3))),
}
"""Direction in which the slope falls or rises, from that in which the robot looks [deg], and the course."""


def world_of(case: str, slope: float, seed: int) -> str:
    """Return the text of a world file."""
    if case == "uneven":
        size = f"size: [10.0, 10.0], height: {0.01 * seed:g}, length: {(0.75, 0.5, 0.25)[seed % 3]}, seed: {seed}"
        return f"ground: {{exists: false}}\ngrids:\n  waves: {{spacing: 0.05, uneven: {{{size}}}}}\n"
    yaw, pitch = math.radians(CASES[case][0]), math.radians(slope)
    falls = "down" in case
    pitch = pitch if falls else -pitch
    length, thick = 8.0, 0.4
    along = FOLD + 0.5 * length * math.cos(pitch) - 0.5 * thick * math.sin(pitch)
    height = -0.5 * length * math.sin(pitch) - 0.5 * thick * math.cos(pitch)
    place = f"[{along * math.cos(yaw):.6f}, {along * math.sin(yaw):.6f}, {height:.6f}]"
    boxes = (
        f"boxes:\n  slope: {{size: [{length}, 8.0, {thick}], position: {place}, rpy: [0.0, {pitch:.9f}, {yaw:.9f}]}}\n"
    )
    if not falls:
        return boxes
    middle = FOLD - 2.0
    place = f"[{middle * math.cos(yaw):.6f}, {middle * math.sin(yaw):.6f}, -0.2]"
    level = f"  level: {{size: [4.0, 8.0, 0.4], position: {place}, rpy: [0.0, 0.0, {yaw:.9f}]}}\n"
    return f"ground: {{exists: false}}\n{boxes}{level}"


def run(case: str, slope: float, options: dict[str, Any]) -> dict[str, Any]:
    """Drive along a case; return the figures."""
    logging.disable(logging.WARNING)
    seed, options = options["seed"], {key: each for key, each in options.items() if key != "seed"}
    options |= wrong_robot(seed, driven(None).urdf)
    with tempfile.TemporaryDirectory() as folder:
        world = Path(folder) / "world.yaml"
        world.write_text(world_of(case, slope, int(slope)))
        return drive(case, CASES[case][1], seed, world=str(world), **options)


def main() -> int:
    """Run what the command line asks for; return the exit code."""
    parser = parser_of(__doc__)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES))
    parser.add_argument("--slopes", type=float, nargs="+", default=[5.0, 10.0, 15.0], metavar="DEGREES")
    parser.add_argument("--level", action="store_true", help="ask for a level pelvis")
    parser.add_argument("--estimated", action="store_true", help="with the base of odometry and sensors that err")
    parser.add_argument("--seed", type=int, default=0, help="of errors of the robot; 0: no errors")
    parser.add_argument("--transport", type=Path, metavar="FILE", help="faults between simulator and plugins")
    add_engine(parser)
    parser.add_argument("--tags", default="", help="tags that differ from the shipped ones")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    given = parser.parse_args()
    for case in given.cases:
        if case not in CASES:
            parser.error(f"there is no case '{case}'; there are {', '.join(CASES)}")
    logging.disable(logging.WARNING)
    tags = ", ".join(filter(None, ("base: center_of_mass", "tunning: level" if given.level else "", given.tags)))
    options = {"tags": tags, "is_estimated": given.estimated, "seed": given.seed, "transport": given.transport}
    drives = [
        (case, slope, options)
        for case in given.cases or CASES
        for slope in ((1.0, 2.0, 3.0) if case == "uneven" else given.slopes)
    ]
    figures, is_done = Figures(given.json), True
    with ProcessPoolExecutor(given.jobs) as pool:
        for (case, slope, _), line in zip(drives, pool.map(run, *zip(*drives, strict=True)), strict=True):
            is_done &= line["done"]
            figures.row(
                f"{case} {slope:g}",
                vertex_mm=1e3 * line["vertex_max"],
                height_mm=1e3 * line["height_max"],
                margin=line["margin"],
                tilt=math.degrees(line["tilt_max"]),
                tilt_end=math.degrees(line["tilt_end"]),
                duration=line["duration"],
                held="" if line["done"] else line["why"] or line["holds"],
            )
    return 0 if is_done else 1


if __name__ == "__main__":
    supervise()
    sys.exit(main())

#!/usr/bin/env python3
"""How well `odometry` knows where CENTAURO is after one turn, over a transport that delays and loses messages.

Run with `./run exec python benchmark/transport.py [--json] [--seed N] [--log FILE] [--case NAME...]`. The robot drives
0.5 m ahead, once around a circle with a radius of 0.5 m, and 0.5 m ahead, in PyBullet, where it follows this course by
where it truly is. What it does is a log with a row for each millisecond, which `--log` keeps, and uses again. Of it
sensors measure, the IMU at 500 Hz and the joints at 200 Hz, exactly and with the errors of
`config/robots/centauro/robot.yaml`. The methods `filter` and `geometric` work at 200 Hz on what a
transport with faults lets through, all in virtual time. The table has the error of the heading [degrees] and that of
the position [% of the way] at the end; with `--json` each line is an object. The exit code is 1 if `filter` misses 0.5
degrees or 0.3 % (exact), or 0.8 degrees or 0.3 % (with errors).

`--ros` measures a transport instead: `roslaunch solfer figure_5.launch` on a master of its own, whose messages of
joints and IMU are received for 10 s (`--seconds`) as plugins receive them. It prints a file like
`config/transport/quiet.yaml`.
"""

import argparse
import json
import logging
import math
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from estimation_cases.courses import Course, Leg
from estimation_cases.driver import drive
from estimation_cases.log import ROBOT, Log
from estimation_cases.methods import OWN
from estimation_cases.play import BEGIN
from estimation_cases.replay import ROW, Recorded, measure, replay

from solfer.errors import SolferError
from solfer.middleware.memory import FaultsRecord, read_faults
from solfer.supervision import supervise

PROFILES = ROBOT.parents[1] / "transport"
TURN = 2.0 * math.pi
COURSE = Course((Leg(0.5), Leg(0.5 * TURN, turn=TURN), Leg(0.5)))
SENSORS = {"exact": 0.0, "noise": 1.0}
"""Factors of the sensors' errors."""
GOALS = {"exact": (0.5, 0.3), "noise": (0.8, 0.3)}
"""Most that the errors of `filter` may be: heading [degrees], position [% of the way]."""


def _faults(skip: float = 0.0, **topics: dict[str, float]) -> FaultsRecord:
    """Make faults of topics."""
    return FaultsRecord.model_validate({"seed": 1, "topics": topics, "loop": {"skip": skip}})


def _profile(name: str, seed: int) -> FaultsRecord:
    """Read a shipped profile, with another seed."""
    return read_faults(PROFILES / f"{name}.yaml").model_copy(update={"seed": seed})


LATE = {"jitter": 0.015}
CASES = {
    "nothing": _faults(),
    "3 % of joints lost": _faults(joint_states={"loss": 0.03}),
    "10 % of joints lost": _faults(joint_states={"loss": 0.1}),
    "3 % of IMU lost": _faults(imu={"loss": 0.03}),
    "10 % of IMU lost": _faults(imu={"loss": 0.1}),
    "joints 0-15 ms late": _faults(joint_states=LATE),
    "IMU 0-15 ms late": _faults(imu=LATE),
    "both 0-15 ms late": _faults(joint_states=LATE, imu=LATE),
    "IMU's clock 5 ms ahead": _faults(imu={"clock": 0.005}),
    "10 % of cycles left out": _faults(skip=0.1),
    **{f"busy, seed {seed}": _profile("busy", seed) for seed in (1, 2, 3)},
    "bad": _profile("bad", 1),
}


def lines_of(recorded: Recorded, sensors: str, name: str) -> list[dict[str, Any]]:
    """Replay a case; return a line for each method."""
    lines = []
    for method, result in replay(recorded, CASES[name]).items():
        errors = {"heading_error": round(result.heading, 4), "position_error": round(result.position, 4)}
        missed = method == "filter" and any(
            not abs(error) <= most for error, most in zip(errors.values(), GOALS[sensors], strict=True)
        )
        lines.append({"case": name, "sensors": sensors, "method": method, **errors, "missed": missed})
    return lines


def results(log: Log, seed: int, names: Sequence[str], begin: float) -> Iterator[dict[str, Any]]:
    """Yield the lines of all cases with all sensors, for estimators that begin at a time [s]."""
    for sensors, noise in SENSORS.items():
        recorded = measure(log, seed, noise, begin)
        for name in names:
            yield from lines_of(recorded, sensors, name)


def table(lines: Sequence[dict[str, Any]]) -> str:
    """Return a table with a row for each case, and a column for each method with each of the sensors."""
    columns = [(method, sensors) for method in OWN for sensors in SENSORS]
    by_place = {(line["case"], line["method"], line["sensors"]): line for line in lines}
    head = ["case", *(f"`{method}`, {'exact' if sensors == 'exact' else 'with errors'}" for method, sensors in columns)]
    rows = [head, ["---"] * len(head)]
    for name in dict.fromkeys(line["case"] for line in lines):
        found = [by_place[(name, *column)] for column in columns]
        cells = [f"{line['heading_error']:+.2f}, {line['position_error']:.2f} %" for line in found]
        rows.append([name, *(cell + " **missed**" * line["missed"] for cell, line in zip(cells, found, strict=True))])
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def log_of(path: Path, seed: int) -> Log:
    """Drive the course, unless there is a log of it; return the log."""
    if not path.is_file():
        print(f"seed {seed}: drives", file=sys.stderr, flush=True)
        drive(COURSE, seed, ROW).save(path)
    return Log.load(path)


def required(parser: argparse.ArgumentParser, given: argparse.Namespace) -> None:
    """End with an error, exit code 2, if an option has a value that cannot be used."""
    for name in given.case:
        if name not in CASES:
            parser.error(f"there is no case '{name}'; there are {', '.join(CASES)}")
    if not 0 <= given.seed < 2**31:
        parser.error(f"the seed is {given.seed}, expected from 0 to {2**31 - 1}")
    if not 1.0 <= given.seconds <= 3600.0:
        parser.error(f"seconds is {given.seconds:g}, expected from 1 to 3600")
    if given.log is not None and not (given.log.suffix == ".npz" and given.log.parent.is_dir()):
        parser.error(f"the log is {given.log}, expected a file *.npz in a folder that there is")


def main() -> int:
    """Print all figures, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--json", action="store_true", help="an object for each line")
    parser.add_argument("--seed", type=int, default=1, help="of the robot and its sensors")
    parser.add_argument("--log", type=Path, metavar="FILE", help="file of the log (*.npz), kept and used again")
    parser.add_argument(
        "--case", nargs="+", default=list(CASES), metavar="NAME", help=", ".join(CASES).replace("%", "%%")
    )
    parser.add_argument("--ros", action="store_true", help="measure how messages arrive under ROS instead")
    parser.add_argument("--seconds", type=float, default=10.0, help="time for which --ros measures")
    given = parser.parse_args()
    required(parser, given)
    if given.ros:
        from estimation_cases.arrivals import arrivals_under_ros  # noqa: PLC0415 needs ROS

        try:
            print(arrivals_under_ros(given.seconds))
        except SolferError as error:
            print(f"error: {error}", file=sys.stderr)
            return error.exit_code
        return 0
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        log = log_of(given.log or Path(folder, "turn.npz"), given.seed)
        for line in results(log, given.seed, given.case, BEGIN):
            lines.append(line)
            if given.json:
                print(json.dumps(line), flush=True)
            else:
                print(f"{line['sensors']}, {line['case']}, {line['method']}", file=sys.stderr, flush=True)
    if not given.json:
        print(table(lines))
    return int(any(line["missed"] for line in lines))


if __name__ == "__main__":
    supervise()
    logging.disable(logging.WARNING)  # of stamps that are wrong on purpose
    sys.exit(main())

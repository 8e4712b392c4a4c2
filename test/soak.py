#!/usr/bin/env python3
"""Tests that need hours: faults, floods, mutated inputs and robots, drawn by a seed, until the time is up.

Run with `./run test --soak [--minutes N] [--seed S] [--only KIND] [ARGUMENTS for pytest]`. Each trial is a command. Its
result is one line of JSON in `out/soak/S.jsonl`; trials that are in there already are left out, so that a second call
goes on where the first one ended. The exit code is 1 if a trial of this seed failed; each one that did is printed with
the command that repeats it, and leaves its output beside the file.
"""

import argparse
import json
import os
import random
import shlex
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from solfer.supervision import supervise

REPOSITORY = Path(__file__).resolve().parents[1]
OUTPUT = REPOSITORY / "out" / "soak"

LIMIT = 1800.0
"""Longest time of a trial [s]."""

FUZZ = "test/unit/config/test_fuzz.py"
ROBOTS = "test/integration/simulation/test_robots_table.py"
PROPERTIES = "test/unit -m hypothesis --hypothesis-profile soak"


def chaos(scheme: str, system: str) -> Callable[[int], str]:
    """Make commands that break the processes of a figure of the paper."""
    command = f"./run exec python benchmark/chaos.py --scheme {scheme} --system {system} --trials 1"
    return lambda seed: f"{command} --seed {seed}"


KINDS: dict[str, Callable[[int], str]] = {
    "kills of Fig. 4 in ROS": chaos("fig4", "ros"),
    "kills of Fig. 4 in a real-time layer": chaos("fig4", "rt"),
    "kills of Fig. 5 in ROS": chaos("fig5", "ros"),
    "kills of Fig. 5 in a real-time layer": chaos("fig5", "rt"),
    "mutated inputs": lambda seed: f"SOLFER_FUZZ=1000 SOLFER_FUZZ_SEED={seed} ./run test {FUZZ} -q",
    "properties": lambda seed: f"./run test {PROPERTIES} -q --hypothesis-seed {seed}",
    "robots of collections": lambda seed: f"./run test {ROBOTS} -q --robots {seed}",
}
"""Commands that repeat a trial, by the kind of the trial."""


def marked() -> list[str]:
    """Return the ids of the tests with the mark `soak`."""
    command = ["pytest", "--collect-only", "-q", "-m", "soak"]
    listed = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=False).stdout
    return [line for line in listed.splitlines() if "::" in line]


def draw(seed: int, only: str | None, pytest_arguments: list[str]) -> Iterator[tuple[str, str]]:
    """Yield kinds and commands of trials without end, equal ones for equal seeds."""
    chance = random.Random(seed)
    tests = marked()
    kinds = [kind for kind in (*KINDS, *tests) if only is None or only in kind]
    if not kinds:
        names = ", ".join(KINDS)
        print(f"error: no kind of trial has '{only}' in its name", file=sys.stderr)
        print(f"  expected: a part of one of {names}, or of the id of a test with the mark `soak`", file=sys.stderr)
        sys.exit(2)
    while True:
        for kind in chance.sample(kinds, len(kinds)):
            number = chance.randrange(1_000_000)
            command = KINDS[kind](number) if kind in KINDS else f"./run test -m soak {shlex.quote(kind)} -q"
            if " test " in command and pytest_arguments:
                command += f" {shlex.join(pytest_arguments)}"
            yield kind, command


def run(command: str, output: Path) -> int:
    """Run a trial with its output in a file; returns its exit code."""
    with output.open("w") as file:
        try:
            done = subprocess.run(
                ["bash", "-c", command],
                cwd=REPOSITORY,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                timeout=LIMIT,
                check=False,
            )
        except subprocess.TimeoutExpired:
            file.write(f"\nnot finished within {LIMIT:.0f} s\n")
            return 124
    return done.returncode


def soak(seed: int, minutes: float, only: str | None, pytest_arguments: list[str]) -> int:
    """Run trials until the time is up; returns how many of the seed's trials failed."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    file = OUTPUT / f"{seed}.jsonl"
    done = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    results = {result["trial"]: result for result in done}
    end = None
    for trial, (kind, command) in enumerate(draw(seed, only, pytest_arguments), start=1):
        if trial in results and results[trial]["command"] == command:
            continue
        end = end or time.monotonic() + 60.0 * minutes  # the tests are collected, and earlier trials left out
        left = end - time.monotonic()
        if left <= 0.0:
            break
        print(f"trial {trial}, {left / 60.0:.0f} min left: {kind}", file=sys.stderr, flush=True)
        begin = time.monotonic()
        output = OUTPUT / f"{seed}-{trial}.log"
        code = run(command, output)
        seconds = round(time.monotonic() - begin, 1)
        results[trial] = {"trial": trial, "kind": kind, "command": command, "code": code, "seconds": seconds}
        with file.open("a") as lines:
            lines.write(json.dumps(results[trial]) + "\n")
        if code:
            print(f"failed with code {code}: {command}\n  output: {output}", flush=True)
        else:
            output.unlink()
    failed = [result for result in results.values() if result["code"]]
    print(f"{len(results)} trials of seed {seed}, {len(failed)} failed; results in {file}")
    for result in failed:
        print(f"  {result['command']}")
    return len(failed)


def main() -> int:
    """Read the command line and run trials."""
    parser = argparse.ArgumentParser(
        prog="./run test --soak", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=60.0, help="time after which no trial begins (default: 60)")
    parser.add_argument("--seed", type=int, default=int(time.strftime("%Y%m%d")), help="default: the date")
    parser.add_argument("--only", metavar="KIND", help="kinds of trials with this in their names")
    options, pytest_arguments = parser.parse_known_args()
    os.environ["PYTHONUNBUFFERED"] = "1"
    try:
        return 1 if soak(options.seed, options.minutes, options.only, pytest_arguments) else 0
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    supervise()
    sys.exit(main())

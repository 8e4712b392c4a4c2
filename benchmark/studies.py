#!/usr/bin/env python3
"""How well studies survive kills, what they cost beside their simulations, and whether every engine agrees.

Run with `./run exec python benchmark/studies.py PART... [--json] [--seed N] [--runs N]`. Parts are

- `kills`: 100 runs of 5 s, of which workers and the coordinator are killed 10 times at random moments; `same` is
  whether the table is that of an undisturbed study, `again` how many runs were taken up more than once;
- `overhead`: time of a study of runs of 30 s with one worker, beside that of the simulations alone, each with its load
  and connection, in one process after the other; and `speedup`: how many times faster two workers are than one;
- `engines`: whether local processes, Dask with two workers and one node of Slurm (as root, with Debian's `slurm-wlm`
  and `munge`) make the same table;
- `report`: time of the page of 10 000 runs [s].

Progress is on stderr. The exit code is 1 where a goal is missed: the same tables, at most 10 % on top of the
simulations, 1.7 times as fast with two processors, a page in 10 s.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from solfer.supervision import descendants, supervise
from solfer_tools.study import Result, read_study
from solfer_tools.study.folder import StudyFolder
from solfer_tools.study.report import write_report

ROOT = Path(__file__).resolve().parents[1]
SOLFER = str(ROOT / "nodes/solfer")
SLURM = str(ROOT / "test/support/study/one_node_slurm")

KILLS = 10
LARGEST_OVERHEAD, LEAST_SPEEDUP, LONGEST_REPORT = 0.1, 1.7, 10.0
"""Goals: share of the simulations' time, times faster with two workers, time of a page [s]."""


def study_file(folder: Path, runs: int, duration: float, **tags: Any) -> Path:
    """Write a study of so many runs of a duration [s], whose masses are drawn."""
    tree = {
        "configuration": {"file": str(ROOT / "config/centauro.yaml")},
        "plugins": ["odometry3::odometry", "wheeled_motion"],
        "settle": 1.0,
        "duration": duration,
        "runs": runs,
        "vary": {"mass": {"path": "simulation/mass", "uniform": [0.95, 1.05]}},
        "measure": {
            "way": {"columns": ["simulation/base/x", "simulation/base/y"], "reduce": "max"},
            "tilt": {"columns": "simulation/base/tilt", "reduce": "max"},
        },
        **tags,
    }
    file = folder / "study.yaml"
    file.write_text(json.dumps(tree))
    return file


def command(file: Path, out: Path, *more: str) -> list[str]:
    """Return the command of a study."""
    return [sys.executable, SOLFER, "study", str(file), "--out", str(out), *more]


def carried_out(file: Path, out: Path, *more: str, **environment: str) -> float:
    """Carry out a study; return its time [s]."""
    begin = time.monotonic()
    subprocess.run(command(file, out, *more), check=True, stdout=subprocess.DEVNULL, env={**os.environ, **environment})
    return time.monotonic() - begin


def table(out: Path) -> str:
    """Return the table of a study."""
    return (out / "table.csv").read_text()


def kills(folder: Path, runs: int, seed: int) -> dict[str, Any]:
    """Kill workers and the coordinator of a study at random moments."""
    file, draw = study_file(folder, runs, 5.0), random.Random(seed)
    undisturbed = carried_out(file, folder / "undisturbed")
    out, killed = folder / "killed", {"worker": 0, "coordinator": 0, "run": 0}
    process = subprocess.Popen(command(file, out), stdout=subprocess.DEVNULL)
    while sum(killed.values()) < KILLS:
        time.sleep(draw.uniform(0.3, 1.5) * undisturbed / KILLS)
        if process.poll() is not None:
            break
        below = descendants(process.pid)
        kind = draw.choice(["worker", "worker", "run", "coordinator"])
        if kind == "coordinator" or not below:
            kind, victim = "coordinator", process.pid
        else:
            workers = [each for each in below if descendants(each)]
            victim = draw.choice([each for each in below if (each in workers) == (kind == "worker")] or below)
        os.kill(victim, signal.SIGKILL)
        killed[kind] += 1
        print(f"kill {sum(killed.values())}: {kind}", file=sys.stderr, flush=True)
        if kind == "coordinator":
            process.wait()
            process = subprocess.Popen(command(file, out), stdout=subprocess.DEVNULL)
    process.wait()
    found = StudyFolder(out)
    again = sum(found.attempts(run) - 1 for run in found.runs)
    same = table(out) == table(folder / "undisturbed")
    return {"runs": runs, "killed": killed, "same": same, "again": again, "good": same and again <= 2 * KILLS}


def overhead(folder: Path, runs: int, seed: int) -> dict[str, Any]:
    """Compare a study with its simulations alone."""
    file = study_file(folder, runs, 30.0, seed=seed)
    code = "import sys; from solfer_tools.study import read_study; from solfer_tools.study.run import carry_out\n"
    code += "import os, time; from solfer_tools.study.simulated_run import rehearse\n"
    code += "study = read_study(sys.argv[1]); runs = study.plan().runs; rehearse(study.record); total = 0.0\n"
    code += "for run in runs:\n    begin = time.monotonic()\n    child = os.fork()\n    if not child:\n"
    code += "        record, over = study.settings(run.variations)\n"
    code += "        carry_out(record, run.seed, over, run.variations); os._exit(0)\n"
    code += "    os.waitpid(child, 0); total += time.monotonic() - begin\nprint(total)"
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    ended = subprocess.run(
        [sys.executable, "-c", code, str(file)], capture_output=True, text=True, check=True, env=environment
    )
    alone = float(ended.stdout)
    one, two = (carried_out(file, folder / f"workers_{count}", "--workers", str(count)) for count in (1, 2))
    share, speedup = one / alone - 1.0, one / two
    good = share <= LARGEST_OVERHEAD and speedup >= LEAST_SPEEDUP
    figures = {"simulations": alone, "one_worker": one, "two_workers": two, "overhead": share, "speedup": speedup}
    return {"runs": runs, **{name: round(value, 3) for name, value in figures.items()}, "good": good}


def engines(folder: Path, runs: int, seed: int) -> dict[str, Any]:
    """Compare the tables of all engines."""
    file = study_file(folder, runs, 2.0, seed=seed)
    carried_out(file, folder / "local", "--workers", "2")
    carried_out(file, folder / "dask", "--engine", "dask", "--workers", "2")
    subprocess.run([SLURM, "start", str(folder / "node")], check=True, stdout=subprocess.DEVNULL)
    try:
        configuration = str(folder / "node/slurm.conf")
        carried_out(file, folder / "slurm", "--engine", "slurm", "--workers", "2", SLURM_CONF=configuration)
    finally:
        subprocess.run([SLURM, "stop", str(folder / "node")], check=False)
    same = {name: table(folder / name) == table(folder / "local") for name in ("dask", "slurm")}
    return {"runs": runs, **same, "good": all(same.values())}


def report(folder: Path, runs: int, seed: int) -> dict[str, Any]:
    """Measure the page of many runs, whose results are drawn."""
    vary = {
        "mass": {"path": "simulation/mass", "uniform": [0.9, 1.1]},
        "delay": {"path": "simulation/delay", "uniform": [0.0, 0.01]},
    }
    study, draw = read_study(study_file(folder, runs, 30.0, vary=vary)), np.random.default_rng(seed)
    begin = time.monotonic()
    found = StudyFolder.create(folder / "out", study, study.plan())
    planned = time.monotonic() - begin
    for run in found.runs:
        found.finish(
            run, Result("" if draw.random() > 0.05 else "fallen", {"way": draw.normal(), "tilt": draw.random()})
        )
    begin = time.monotonic()
    size = write_report(found).stat().st_size
    took = time.monotonic() - begin
    good = took <= LONGEST_REPORT
    return {"runs": runs, "plan": round(planned, 2), "report": round(took, 2), "size": size, "good": good}


PARTS: dict[str, tuple[Callable[[Path, int, int], dict[str, Any]], int]] = {
    "kills": (kills, 100),
    "overhead": (overhead, 8),
    "engines": (engines, 10),
    "report": (report, 10_000),
}


def main() -> int:
    """Run what the command line asks for; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"{', '.join(PARTS)}; default: all")
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn")
    parser.add_argument("--runs", type=int, help="runs of each study (default: those of the goals)")
    parser.add_argument("--json", action="store_true", help="print one object a line")
    given = parser.parse_args()
    unknown = [each for each in given.parts if each not in PARTS]
    if unknown:
        parser.error(f"there is no part '{unknown[0]}'; there are {', '.join(PARTS)}")
    good = True
    for name in given.parts or PARTS:
        measure, runs = PARTS[name]
        print(name, file=sys.stderr, flush=True)
        with tempfile.TemporaryDirectory() as folder:
            figures = {"part": name, **measure(Path(folder), given.runs or runs, given.seed)}
        good = good and bool(figures["good"])
        print(
            json.dumps(figures) if given.json else "  ".join(f"{key} {each}" for key, each in figures.items()),
            flush=True,
        )
    return 0 if good else 1


if __name__ == "__main__":
    supervise()
    sys.exit(main())

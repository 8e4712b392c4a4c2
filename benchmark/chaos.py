#!/usr/bin/env python3
"""Breaks running systems at random, and checks that their robot does nothing that was not commanded.

Run with `./run exec python benchmark/chaos.py [--trials N] [--seed S] [--system ros|rt|both] [--scheme fig4|fig5]`. The
systems are those of Fig. 4 of the paper: with `ros` three plugins as nodes beside the simulator, with `rt` two of them
in a real-time layer with a watchdog, and the third one in ROS behind the bridge. In each trial joints move at 0.5 rad/s
and wheels turn at 1 to 2 rad/s; then one of the processes, or two, are stopped for a while, killed, or restarted.
`test/breaking/bounds.py` has the limits of what the robot may do afterwards.

With `--scheme fig5` a navigation drives the robot of Fig. 5 along its course; one process is killed, has to be missed
by another one, and is started again, after which the course has to go on (`test/breaking/course.py`). Seeds take the
processes in turn. With `--stop S` a process stands still for so long [s] instead. In the table `wheel` is how long
wheels turned on then [s].

With `--sensors` sensors, motors and commands of Fig. 5 are wrong, on the virtual clock and without ROS: a seed draws
motion and size, and consecutive seeds have each of the faults (`test/breaking/sensor_faults.py`). The robot is judged
during a fault and after it (`test/breaking/sensors.py`). In the table are the largest figures of each fault: speed of a
joint as a share of its limit, speeds of base, heading and wheels, and tilt; in how many trials it was named, and after
how long at most [s]; and in how many the robot drove as commanded in the end. Where a call ends, another one goes on
with the next seed.

With `--drives` drives of Fig. 5 break in the same way: a wheel, what steers it, a leg or an arm is without power, or
stuck; consecutive seeds have each of the eight.

With `--sizes` the feedback pipes get the messages of one motion with each of these faults, larger and smaller, until
the smallest size is found that is named within 0.5 s; `--trials` seeds draw joints, axes and signs. In the table are
the largest of their sizes and the geometric mean; of a trial just below the largest, in which the robot has to keep its
bounds, the figures follow. It takes less than a second for each fault and seed, and a trial for each fault.

With `--alarms` the sensors are right, but have three times the shipped noise: a robot is driven on a floor or a ramp,
pushed by 300 N, reset and at last pushed over, for a minute in each trial, and no sensor, joint or motor may be named.

Progress goes to stderr, a table to stdout: how fast wheels turned that have to be at rest, how far joints were from
where they may be, quietly and while wheels brake, and how fast they moved. Exit code 1 if any trial failed; each
failure is printed with the command that repeats it.
"""

import argparse
import contextlib
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from form import Figures, parser_of

REPOSITORY = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(REPOSITORY / "test"))

from breaking.bounds import FIGURES, Verdict  # noqa: E402
from breaking.course import CourseTrial, draw_kill, ros_figure_5, rt_figure_5  # noqa: E402
from breaking.figures import ros_figure_4, rt_figure_4  # noqa: E402
from breaking.processes import until  # noqa: E402
from breaking.systems import System  # noqa: E402
from breaking.trial import Plan, Trial, draw  # noqa: E402

from solfer.middleware.ros.node.launch import free_port  # noqa: E402
from solfer.supervision import supervise  # noqa: E402

if TYPE_CHECKING:
    from breaking.sensors import Outcome, SensorTrial

SYSTEMS: dict[str, dict[str, Callable[[Path], System]]] = {
    "fig4": {"ros": ros_figure_4, "rt": rt_figure_4},
    "fig5": {"ros": ros_figure_5, "rt": rt_figure_5},
}


@contextlib.contextmanager
def master() -> Iterator[None]:
    """Run a ROS master of its own, with this process as one of its nodes."""
    import rosgraph
    import rospy

    port = free_port()
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    process = subprocess.Popen(
        ["rosmaster", "--core", "-p", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        until(rosgraph.is_master_online, "a ROS master")
        rospy.init_node("chaos", argv=[], disable_signals=True, disable_rostime=True)
        yield
    finally:
        process.kill()
        process.wait()


class Bench:
    """One kind of system, started when a trial needs it, and anew after one that failed.

    Args:
        scheme: The figure.
        name: Its name.
        folder: Folder for the output of its processes.
        stop: For how long a process of Fig. 5 is stopped; 0: it is killed [s].
    """

    def __init__(self, scheme: str, name: str, folder: Path, stop: float = 0.0):
        self._scheme, self._name, self._folder, self._count = scheme, name, folder, 0
        self._stop = stop
        self._system: System | None = None

    def run(self, seed: int) -> tuple[Plan, Verdict]:
        """Run one trial; returns what was done, and what the robot did."""
        try:
            system = self._ready()
        except AssertionError as error:
            self.close()
            return Plan(()), Verdict(findings=[str(error)])
        names = system.processes.names
        course = self._scheme == "fig5"
        trial = CourseTrial(system, draw_kill(seed, names, self._stop)) if course else Trial(system, draw(seed, names))
        plan, verdict = trial.plan, trial.run()
        if verdict.findings:
            self.close()
        return plan, verdict

    def close(self) -> None:
        """End the system, if there is one."""
        if self._system is not None:
            self._system.close()
            self._system = None

    def _ready(self) -> System:
        if self._system is None:
            self._count += 1
            folder = self._folder / f"{self._name}-{self._count}"
            folder.mkdir(parents=True)
            self._system = SYSTEMS[self._scheme][self._name](folder)
            if self._scheme == "fig4":
                self._system.start()
            else:
                self._system.revive()
        return self._system


class Table:
    """The worst of each kind of fault."""

    def __init__(self) -> None:
        self._rows: dict[tuple[str, str, str], tuple[int, int, Verdict]] = {}
        self.failures = 0

    def add(self, system: str, plan: Plan, verdict: Verdict) -> None:
        """Add a trial."""
        kind = " + ".join(fault.kind for fault in plan.faults) or "none"
        victim = " + ".join(fault.victim for fault in plan.faults) or "none"
        trials, failures, worst = self._rows.get((system, kind, victim), (0, 0, Verdict()))
        worst.add(verdict)
        self._rows[system, kind, victim] = trials + 1, failures + bool(verdict.findings), worst
        self.failures += bool(verdict.findings)

    def show(self, figures: Figures) -> None:
        """Print a row of each."""
        for (system, kind, victim), (trials, failures, worst) in sorted(self._rows.items()):
            numbers = {name: float(getattr(worst, name)) for name in FIGURES}
            figures.row(f"{system}: {kind}, {victim}", trials=trials, **numbers, failures=failures)


def log(text: str) -> None:
    """Progress."""
    print(text, file=sys.stderr, flush=True)


def run(options: argparse.Namespace, folder: Path) -> Table:
    """Run all trials."""
    names, table = [options.system] if options.system != "both" else ["ros", "rt"], Table()
    for name in names:
        with contextlib.closing(Bench(options.scheme, name, folder, options.stop)) as bench:
            for number in range(options.trials):
                seed, begin = options.seed + number, time.monotonic()
                plan, verdict = bench.run(seed)
                table.add(name, plan, verdict)
                what = " and ".join(map(str, plan.faults))
                log(
                    f"{name} {number + 1}/{options.trials} seed {seed}: {what} ({time.monotonic() - begin:.1f} s): "
                    f"{'FAILED' if verdict.findings else 'good'}"
                )
                for finding in verdict.findings:
                    log(f"    {finding}")
                if verdict.findings:
                    log(
                        f"failed: --scheme {options.scheme} --system {name} --stop {options.stop:g} "
                        f"--trials 1 --seed {seed}"
                        f"  ({what}): "
                        f"{verdict.findings[0]}"
                    )
    return table


MINUTE = 60.0
"""Time for which a robot is driven in a trial with `--alarms` [s]."""

SENSOR_FIGURES = ("joint", "base", "turn", "wheel", "tilt")
"""Largest speeds: of a joint [its limit], the base [m/s], its heading [rad/s], a wheel [rad/s]; and tilt [rad]."""


class SensorTable:
    """The worst of each fault of a sensor or drive.

    Args:
        option: The option of these faults.

    Attributes:
        failed: The command that repeats each trial that failed, what it was, and its findings.
    """

    def __init__(self, option: str) -> None:
        self._option = option
        self._rows: dict[str, list[Outcome]] = {}
        self.failed: list[str] = []

    def add(self, trial: "SensorTrial", outcome: "Outcome") -> None:
        """Add a trial."""
        self._rows.setdefault(trial.fault, []).append(outcome)
        if outcome.findings:
            what = f"{trial.motion}, {trial.fault} {outcome.size}".strip()
            command = f"./run exec python benchmark/chaos.py {self._option} --trials 1 --seed {trial.seed}"
            self.failed.append(f"{command}  # {what}: {'; '.join(outcome.findings)}")

    def show(self, figures: Figures) -> None:
        """Print a row of each fault, and the failures to stderr."""
        for fault, outcomes in sorted(self._rows.items()):
            times = [each.named_after for each in outcomes if each.named]
            figures.row(
                fault,
                trials=len(outcomes),
                **{name: max(float(getattr(each, name)) for each in outcomes) for name in SENSOR_FIGURES},
                named=len(times),
                after=max(times, default=None),
                drives=sum(each.obeys for each in outcomes),
                failures=sum(bool(each.findings) for each in outcomes),
            )
        for text in self.failed:
            log(f"failed: {text}")


def run_sensors(options: argparse.Namespace) -> int:
    """Run trials with wrong sensors or broken drives; return the exit code."""
    from breaking.sensor_faults import DRIVES
    from breaking.sensors import ORDER, check_outcome, drawn

    faults, option = (list(DRIVES), "--drives") if options.drives else (ORDER, "--sensors")
    table, begin = SensorTable(option), time.monotonic()
    try:
        for number in range(options.trials):
            seed = options.seed + number
            trial = drawn(seed, faults)
            outcome = check_outcome(trial, trial.run())
            table.add(trial, outcome)
            left = (time.monotonic() - begin) / (number + 1) * (options.trials - number - 1)
            what = f"{trial.motion}, {trial.fault} {outcome.size}".strip()
            verdict = f"FAILED: {'; '.join(outcome.findings)}" if outcome.findings else "good"
            named = f"+{outcome.named_after:.2f} s {outcome.named[0][1][:100]}" if outcome.named else "nothing is named"
            end = "drives" if outcome.obeys else f"{', '.join(outcome.stopped) or 'nothing'} stopped: {outcome.advice}"
            log(f"{number + 1}/{options.trials} seed {seed}: {what}: {verdict} ({named}; {end}; {left:.0f} s left)")
    except KeyboardInterrupt:
        log(f"interrupted; goes on with --seed {seed}")
        table.show(Figures(options.json))
        return 130
    table.show(Figures(options.json))
    return 1 if table.failed else 0


def run_sizes(options: argparse.Namespace) -> int:
    """Find the smallest size of each fault that is named soon, and run a trial below it; return the exit code."""
    from breaking.sensors import SIZES, Messages, SensorTrial, check_outcome

    table = Figures(options.json)
    failures = 0
    with contextlib.closing(Messages("turns")) as messages:
        for fault, (_, _, unit) in SIZES.items():
            found = [
                (*messages.smallest(fault, seed), seed) for seed in range(options.seed, options.seed + options.trials)
            ]
            size, below, reason, seed = max(found, key=lambda each: each[:2])
            mean = math.exp(sum(math.log(each[0]) for each in found) / len(found))
            trial = SensorTrial("turns", fault, seed, below)
            outcome = check_outcome(trial, trial.run())
            failures += bool(outcome.findings)
            numbers = {name: float(getattr(outcome, name)) for name in SENSOR_FIGURES}
            texts = {"findings": "; ".join(outcome.findings) or "none", "reason": reason}
            table.row(f"{fault} [{unit}]", named_from=size, mean=mean, **numbers, **texts)
    return 1 if failures else 0


def run_alarms(options: argparse.Namespace) -> int:
    """Drive robots whose sensors are right; return the exit code."""
    from breaking.alarms import find_alarms

    failures = 0
    for number in range(options.trials):
        seed = options.seed + number
        alarms, _ = find_alarms(seed, MINUTE)
        failures += bool(alarms)
        log(f"{number + 1}/{options.trials} seed {seed}: {len(alarms)} alarms")
        for time_of_alarm, text in alarms:
            log(f"failed: --alarms --trials 1 --seed {seed}: at {time_of_alarm:.2f} s {text}")
    Figures(options.json).row("sound sensors", minutes=options.trials, false_alarms=failures)
    return 1 if failures else 0


def interrupt(number: int, frame: object) -> None:
    """Handle a signal that requests the end."""
    raise KeyboardInterrupt


def main() -> int:
    """Run all trials and print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("--trials", type=int, default=20, help="number of trials of each system (default: 20)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the first trial; the next one has the next number")
    parser.add_argument("--scheme", choices=SYSTEMS, default="fig4", help="figure of the paper (default: fig4)")
    parser.add_argument(
        "--system", choices=("ros", "rt", "both"), default="both", help="what is broken (default: both)"
    )
    parser.add_argument("--stop", type=float, default=0.0, help="stop a process of Fig. 5 for so long instead [s]")
    parser.add_argument("--sensors", action="store_true", help="wrong sensors of Fig. 5, on the virtual clock")
    parser.add_argument("--drives", action="store_true", help="drives of Fig. 5 that break, on the virtual clock")
    parser.add_argument("--sizes", action="store_true", help="smallest sizes of wrong sensors that are named")
    parser.add_argument("--alarms", action="store_true", help="sensors that are right and never to be named")
    parser.add_argument("--logs", type=Path, help="folder that keeps the output of the processes (default: none)")
    options = parser.parse_args()
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, interrupt)
    runs = {"sensors": run_sensors, "drives": run_sensors, "sizes": run_sizes, "alarms": run_alarms}
    for name in (name for name in runs if getattr(options, name)):
        try:
            return runs[name](options)
        except KeyboardInterrupt:
            return 130
    with contextlib.ExitStack() as stack:
        folder = options.logs or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        stack.enter_context(master())
        try:
            table = run(options, folder)
        except KeyboardInterrupt:
            return 130
    table.show(Figures(options.json))
    return 1 if table.failures else 0


if __name__ == "__main__":
    supervise()
    sys.exit(main())

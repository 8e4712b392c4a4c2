#!/usr/bin/env python3
"""Measures how the simulator keeps time under ROS.

A plugin at 200 Hz, `rosbag record -a` and `robot_state_publisher` run beside it.

Run with `./run exec python benchmark/ros_load.py [SECONDS] [--rates joints=500,contacts=200]` on a machine that does
nothing else. Prints for real time and for "as fast as possible" the real-time factor over the whole time and in its
worst second, the simulated time that was lost, the plugin's cycle, and the processor time that each process used for a
simulated second, which depends less on what else the machine does. The recorder begins when everything else runs; the
time that was lost while it connected is printed apart from what was lost afterwards.
"""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from form import Figures, parser_of

from solfer.middleware.ros import RosMiddleware, RosNode
from solfer.middleware.ros.node.launch import Launch, free_port
from solfer.supervision import supervise
from solfer.transport.middleware import HealthReport

LOST = "time lost [s]"
TICKS = os.sysconf("SC_CLK_TCK")
SETTLE = 5.0
"""Time that nodes get to find each other [s]."""

RATES = "joints=500,base=200,imu=200,motors=200,contacts=200"
NODES = ("simulator", "plugin", "record", "robot_state_publisher", "rosmaster", "rosout")
CASES = (("1", "alone"), ("1", "recorded"), ("0", "alone"), ("0", "recorded"))
"""Factor of the simulated time, and whether a recorder runs."""


def main() -> None:
    """Measure each case in processes of its own: a process has one node only."""
    parser = parser_of(__doc__)
    parser.add_argument("seconds", type=float, nargs="?", default=15.0)
    parser.add_argument("--rates", default=RATES, help=f"rates of publication (default: {RATES})")
    parser.add_argument("--case", nargs=2, metavar=("FACTOR", "RECORDER"), help="this case only, such as: 1 recorded")
    options = parser.parse_args()
    if options.case:
        case(
            options.seconds,
            options.rates,
            float(options.case[0]),
            recorder=options.case[1],
            figures=Figures(options.json),
        )
        return
    for one in CASES:
        command = [sys.executable, __file__, f"{options.seconds:g}", "--rates", options.rates, "--case", *one]
        subprocess.run([*command, *(["--json"] if options.json else [])], check=True)


def case(seconds: float, rates: str, factor: float, recorder: str, figures: Figures) -> None:
    """Measure one case and print it."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "launch.log")
        arguments = ["solfer", "joint_states.launch", f"factor:={factor:g}", f"rates:={rates}"]
        with Launch(arguments, log, free_port()) as system:
            system.wait_for_master(60.0)
            with contextlib.closing(RosMiddleware(RosNode("load", ["load"]))) as middleware:
                while not {"simulation", "joint_states"} <= middleware.reports().keys():
                    system.check()
                    time.sleep(0.1)
                time.sleep(SETTLE)
                before = lost(middleware)
                with recording(folder, recorder):
                    time.sleep(SETTLE)
                    connected = lost(middleware)
                    title = f"{'real time' if factor else 'as fast as possible'}, {recorder}"
                    lost_before = {"begin_lost_s": before, "connecting_lost_s": connected - before}
                    figures.row(title, **measure(seconds, middleware), **lost_before)


@contextlib.contextmanager
def recording(folder: str, recorder: str) -> Iterator[None]:
    """Run `rosbag record -a` if it is to be measured."""
    if recorder != "recorded":
        yield
        return
    command = ["rosbag", "record", "-a", "-O", str(Path(folder, "load.bag"))]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        yield
    finally:
        os.killpg(process.pid, signal.SIGINT)
        process.wait(10.0)


def measure(seconds: float, middleware: RosMiddleware) -> dict[str, float]:
    """Receive the reports for `seconds` and return their figures."""
    begin, used, start = dict(middleware.reports()), cpu(), time.monotonic()
    factors = []
    while time.monotonic() - start < seconds:
        time.sleep(1.0)
        factors.append(value(middleware.reports(), "simulation", "real-time factor"))
    end, spent = dict(middleware.reports()), cpu()
    before, after = (value(reports, "simulation", "time [s]") for reports in (begin, end))
    passed = after - before
    shares = {name: (ticks - used.get(name, 0)) / TICKS / passed for name, ticks in spent.items()}
    busiest = sorted(shares.items(), key=lambda item: -item[1])[:5]
    return {
        "factor": sum(factors) / len(factors),
        "worst_factor": min(factors),
        "lost_s": value(end, "simulation", LOST) - value(begin, "simulation", LOST),
        "cycle_p50_ms": value(end, "joint_states", "cycle median [ms]"),
        "cycle_p99_ms": value(end, "joint_states", "cycle p99 [ms]"),
        "transport_p50_ms": value(end, "joint_states", "transport median [ms]"),
        **{f"{name}_core_s": share for name, share in busiest},
        "load": float(Path("/proc/loadavg").read_text().split()[0]),
    }


def lost(middleware: RosMiddleware) -> float:
    """Read the simulated time that was lost so far [s]."""
    return value(middleware.reports(), "simulation", LOST)


def value(reports: Mapping[str, HealthReport], name: str, key: str) -> float:
    """Look up a figure of a health report; nan if it is not there."""
    return float(reports[name].values.get(key, "nan")) if name in reports else float("nan")


def cpu() -> dict[str, int]:
    """Read the processor time that the nodes started by this process have used so far, by their names [ticks]."""
    parents, programs, ticks = {}, {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            words = (folder / "cmdline").read_bytes().split(b"\0")
            fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
            parents[folder.name] = fields[1]
            programs[folder.name] = next((name for word in words if (name := Path(word.decode()).name) in NODES), None)
            ticks[folder.name] = int(fields[11]) + int(fields[12])
    used: dict[str, int] = {}
    for process, program in programs.items():
        ancestor = process
        while ancestor in parents and ancestor != str(os.getpid()):
            ancestor = parents[ancestor]
        if program is not None and ancestor in parents:
            used[program] = used.get(program, 0) + ticks[process]
    return used


if __name__ == "__main__":
    supervise()
    main()

#!/usr/bin/env python3
"""How the simulator keeps time under ROS: with a plugin at 200 Hz, `rosbag record -a` and `robot_state_publisher`.

Run with `./run exec python benchmark/ros_load.py [SECONDS]` on a machine that does nothing else. Prints for real time
and for "as fast as possible" the real-time factor over the whole time and in its worst second, the simulated time that
was lost, the plugin's cycle, and the share of a core that each process used. What was lost while everything began is
told apart.
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

from solfer.middleware.ros import Node, RosMiddleware
from solfer.middleware.ros.launch import Launch, free_port
from solfer.pipes.middleware import Report

TICKS = os.sysconf("SC_CLK_TCK")
SETTLE = 6.0
"""Time that all nodes get to find each other [s]."""


def main() -> None:
    """Measure each case in processes of its own: a process has one node only."""
    if len(sys.argv) == 4:
        case(float(sys.argv[1]), float(sys.argv[2]), sys.argv[3])
        return
    seconds = sys.argv[1] if len(sys.argv) > 1 else "15"
    for factor, recorder in (("1", "alone"), ("1", "recorded"), ("0", "alone"), ("0", "recorded")):
        subprocess.run([sys.executable, __file__, seconds, factor, recorder], check=True)


def case(seconds: float, factor: float, recorder: str) -> None:
    """Measure one case and print it."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "launch.log")
        with Launch(["solfer", "joint_states.launch", f"factor:={factor:g}"], log, free_port()) as system:
            system.wait_for_master(20.0)
            with contextlib.closing(RosMiddleware(Node("load", ["load"]))) as middleware, recording(folder, recorder):
                middleware.reports()
                time.sleep(SETTLE)
                system.check()
                measure(seconds, factor, recorder, middleware)


@contextlib.contextmanager
def recording(folder: str, recorder: str) -> Iterator[None]:
    """`rosbag record -a` if it is asked for."""
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


def measure(seconds: float, factor: float, recorder: str, middleware: RosMiddleware) -> None:
    """Watch the reports for `seconds` and print what they say."""
    begin, used, start = dict(middleware.reports()), cpu(), time.monotonic()
    factors = []
    while time.monotonic() - start < seconds:
        time.sleep(1.0)
        factors.append(value(middleware.reports(), "simulation", "real-time factor"))
    passed, end = time.monotonic() - start, middleware.reports()
    lost = value(end, "simulation", "time lost [s]") - value(begin, "simulation", "time lost [s]")
    title = "real time" if factor else "as fast as possible"
    print(f"{title}, {'with' if recorder == 'recorded' else 'without'} rosbag record -a, {passed:.0f} s")
    print(f"  real-time factor           {sum(factors) / len(factors):.3f}, worst second {min(factors):.3f}")
    print(f"  simulated time lost        {lost:.3f} s, while everything began "
          f"{value(begin, 'simulation', 'time lost [s]'):.3f} s")
    print(f"  plugin's cycle             {value(end, 'joint_states', 'cycle median [ms]'):.3f} ms median, "
          f"{value(end, 'joint_states', 'cycle p99 [ms]'):.3f} ms p99")
    print(f"  transport of a cycle       {value(end, 'joint_states', 'transport median [ms]'):.3f} ms median")
    shares = {name: (ticks - used.get(name, 0)) / TICKS / passed for name, ticks in cpu().items()}
    busiest = sorted(shares.items(), key=lambda item: -item[1])[:5]
    print(f"  share of a core            {', '.join(f'{name} {share:.2f}' for name, share in busiest)}", flush=True)


def value(reports: Mapping[str, Report], name: str, key: str) -> float:
    """A figure of a health report; nan if it is not there."""
    return float(reports[name].values.get(key, "nan")) if name in reports else float("nan")


def cpu() -> dict[str, int]:
    """Processor time that the processes of ROS used so far, by their names [ticks]."""
    used: dict[str, int] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            words = (folder / "cmdline").read_bytes().split(b"\0")
            program = next((Path(word.decode()).name for word in words if b"/solfer/" in word or b"/plugins/" in word
                            or b"/record" in word or b"robot_state_publisher" in word), None)
            if program is not None:
                fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
                used[program] = used.get(program, 0) + int(fields[11]) + int(fields[12])
    return used


if __name__ == "__main__":
    main()

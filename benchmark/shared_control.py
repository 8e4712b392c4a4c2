#!/usr/bin/env python3
"""Measures the latency of a joint command through Fig. 4: plugin on a part -> plugin that merges -> simulator.

Run with `./run exec python benchmark/shared_control.py [SECONDS]` on a machine that does nothing else. Prints the time
from the stamp of a message of /upper_body and /lower_body to the stamp of the first command of /whole_body that holds
its numbers, in periods of the plugins, and the processor time that each process uses. What is left to the simulator is
the wait for its next step: half a millisecond on average.
"""

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from form import Figures, parser_of

from solfer.middleware.ros import RosMiddleware, RosNode
from solfer.middleware.ros.node.launch import Launch, free_port
from solfer.supervision import supervise
from solfer.transport.messages import JointMessage
from solfer_tools.demo.story import MoveJoints, Reply

RATES = {"NRT": 200.0, "RT": 500.0}
"""Rates of the layers of config/centauro.yaml [Hz]."""

CONFIG = Path(__file__).resolve().parents[1] / "config"
TICKS = os.sysconf("SC_CLK_TCK")
PLUGINS = ("upper_body", "lower_body", "whole_body")
JOINTS = {"upper_body": ("torso_yaw", 0.5), "lower_body": ("ankle_yaw_1", 0.8)}
SPEED = 0.05
"""Slow, so that the motion lasts as long as the measurement [rad/s]."""


def processor_times() -> dict[str, float]:
    """Read the processor time that each of the nodes has used so far [s]."""
    times = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(OSError):
                line = (folder / "cmdline").read_bytes().split(b"\0")
                named = next((part[8:].decode() for part in line if part.startswith(b"__name:=")), "")
                if named in (*PLUGINS, "simulator"):
                    used = (folder / "stat").read_text().rpartition(")")[2].split()[11:13]
                    times[named] = sum(map(int, used)) / TICKS
    return times


def latencies(sent: list[JointMessage], commands: list[JointMessage], joint: str) -> np.ndarray:
    """Compute the time from each message to the first command that has gone as far, in motion only, shape (k,) [s]."""
    stamps = np.array([message.stamp for message in commands])
    reached = np.array([message.position[message.names.index(joint)] for message in commands])
    waits = []
    for before, message in zip(sent, sent[1:], strict=False):
        index = message.names.index(joint)
        if message.position[index] != before.position[index]:
            found = np.flatnonzero((reached == message.position[index]) & (stamps >= message.stamp))
            if len(found):
                waits.append(stamps[found[0]] - message.stamp)
    return np.array(waits)


def configuration(folder: Path, layer: str) -> Path:
    """Write CENTAURO's configuration with all plugins under ROS at the rate of a layer."""
    for name in ("support", "robots"):
        (folder / name).symlink_to(CONFIG / name)
    file = folder / "centauro.yaml"
    file.write_text((CONFIG / file.name).read_text().replace("support/NRT.yaml", f"support/{layer}.yaml"))
    return file


def measure(middleware: RosMiddleware, seconds: float, rate: float, figures: Figures) -> None:
    """Move both parts and print the figures."""
    received = {name: middleware.queue(name, "solfer/JointCommand", 100_000) for name in JOINTS}
    commands = middleware.queue("position_controller/command", "solfer/JointCommand", 100_000)
    time.sleep(1.0)
    for plugin, (joint, goal) in JOINTS.items():
        request = MoveJoints(joints=(joint,), positions=(goal,), speed=SPEED)
        middleware.call(f"{plugin}/trajectory", "solfer/MoveJoints", request, Reply, 3.0)
    before, start = processor_times(), time.monotonic()
    time.sleep(seconds)
    after, passed = processor_times(), time.monotonic() - start
    sent = commands.drain()
    for plugin, (joint, _) in JOINTS.items():
        waits = latencies(received[plugin].drain(), sent, joint) * rate
        title = f"{rate:g} Hz: {plugin} to whole_body"
        figures.row(title, p50_periods=float(np.median(waits)), p99_periods=float(np.percentile(waits, 99)))
    for name, used in after.items():
        figures.row(f"{rate:g} Hz: {name}", core=(used - before[name]) / passed)


def main() -> None:
    """Measure at both rates, each in a process of its own: a process has one node only."""
    parser = parser_of(__doc__)
    parser.add_argument("seconds", type=float, nargs="?", default=15.0)
    parser.add_argument("--layer", choices=RATES, help="this one only")
    options = parser.parse_args()
    if options.layer is None:
        for layer in RATES:
            command = [sys.executable, __file__, f"{options.seconds:g}", "--layer", layer]
            subprocess.run([*command, *(["--json"] if options.json else [])], check=True)
        return
    rate = RATES[options.layer]
    with tempfile.TemporaryDirectory() as folder:
        file = configuration(Path(folder), options.layer)
        scheme = ["motion:=joints", "merging:=whole_body"]
        arguments = ["solfer", "figure_4.launch", *scheme, f"config:={file}", f"rates:=joints={rate:g}"]
        with Launch(arguments, Path(folder, "launch.log"), free_port()) as system:
            system.wait_for_master(60.0)
            with contextlib.closing(RosMiddleware(RosNode("shared_control", ["shared_control"]))) as middleware:
                while not set(PLUGINS) <= {name for name, report in middleware.reports().items() if not report.level}:
                    system.check()
                    time.sleep(0.1)
                measure(middleware, options.seconds, rate, figures=Figures(options.json))


if __name__ == "__main__":
    supervise()
    main()

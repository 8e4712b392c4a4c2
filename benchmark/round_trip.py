#!/usr/bin/env python3
"""Measures a message of 42 joints from one process to another and back, on each middleware.

Run with `./run exec python benchmark/round_trip.py [--seconds S]` (default 20 each, at 500 Hz). The other process
writes each message that it reads; both look for messages every 0.2 ms, as loops do. It starts a ROS master of its own,
and runs itself by `./run ros2` for ROS 2. Times in milliseconds. The exit code is 1 if the p99 of ROS 2 is above 10 ms.
"""

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from form import Figures, parser_of

from solfer.segments.namespace import Namespace
from solfer.supervision import supervise
from solfer.transport.messages import JointMessage
from solfer.transport.middleware import Middleware

RUN = Path(__file__).resolve().parents[1] / "run"
MESSAGE = "sensor_msgs/JointState"
JOINTS = tuple(f"joint_{index}" for index in range(42))
RATE = 500.0
LOOK = 2e-4
"""Time between two looks for messages [s]."""

GOAL = 10.0
"""Most that the p99 of ROS 2 may be [ms]."""


def connect(kind: str, name: str, folder: str) -> Middleware:
    """Connect a node to a middleware."""
    if kind == "shared memory":
        from solfer.middleware.shared_memory.middleware import XbotMiddleware  # noqa: PLC0415 one is needed

        return XbotMiddleware(Namespace("round-trip", Path(folder)), name)
    if kind == "ROS 2":
        from solfer.middleware.ros2 import connect as connect_ros2  # noqa: PLC0415

        return connect_ros2(name, [name])
    from solfer.middleware.ros import RosMiddleware, RosNode  # noqa: PLC0415

    return RosMiddleware(RosNode(name, [name]))


def echo(kind: str, folder: str) -> None:
    """Write what is read, until the process is ended."""
    with contextlib.closing(connect(kind, "echo", folder)) as middleware:
        reader, writer = middleware.reader("there", MESSAGE), middleware.writer("back", MESSAGE)
        while middleware.running():
            if reader.read():
                writer.write(reader.message)
            time.sleep(LOOK)


def measure(kind: str, folder: str, seconds: float) -> dict[str, float]:
    """Return the figures of a middleware."""
    numbers = np.zeros(len(JOINTS))
    sent: dict[int, float] = {}
    times: list[float] = []
    with contextlib.closing(connect(kind, "origin", folder)) as middleware:
        writer, reader = middleware.writer("there", MESSAGE), middleware.reader("back", MESSAGE)
        other = subprocess.Popen([sys.executable, __file__, "--echo", kind, "--folder", folder])
        try:
            begin, count = time.monotonic(), 0
            while len(times) < RATE * seconds:
                count += 1
                numbers[:] = count
                sent[count] = time.monotonic()
                if sent[count] > begin + 3.0 * seconds + 60.0:
                    raise SystemExit(f"{kind}: nothing comes back")
                writer.write(JointMessage(JOINTS, numbers, numbers, numbers))
                while (left := begin + count / RATE - time.monotonic()) > 0.0:
                    time.sleep(min(LOOK, left))
                    if reader.read():
                        now, newest = time.monotonic(), round(reader.message.position[0])
                        times += [now - sent[number] for number in sent if number <= newest and count > 5.0 * RATE]
                        sent = {number: at for number, at in sent.items() if number > newest}
        finally:
            other.terminate()
            other.wait(30.0)
    p50, p90, p99 = np.quantile(1e3 * np.array(times), (0.5, 0.9, 0.99))
    return {"p50_ms": p50, "p90_ms": p90, "p99_ms": p99, "max_ms": 1e3 * max(times), "messages": len(times)}


@contextlib.contextmanager
def master(folder: str) -> Iterator[None]:
    """Run a master of ROS 1."""
    from solfer.middleware.ros.node.launch import Launch, free_port  # noqa: PLC0415

    with Launch(["--core"], Path(folder, "log"), free_port()) as system:
        system.wait_for_master(60.0)
        yield


def results(seconds: float) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield each middleware with its figures."""
    with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:
        yield "shared memory", measure("shared memory", folder, seconds)
    with tempfile.TemporaryDirectory() as folder, master(folder):
        yield "ROS", measure("ROS", folder, seconds)
    environment = os.environ | {"ROS_DOMAIN_ID": str(1 + os.getpid() % 100)}
    command = [RUN, "ros2", "python", __file__, "--seconds", str(seconds), "--json"]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    figures = json.loads(done.stdout.splitlines()[-1])
    yield figures.pop("name"), figures


def main() -> int:
    """Measure, and return the exit code."""
    parser = parser_of(__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="of each middleware (default: %(default)s)")
    parser.add_argument("--echo", metavar="MIDDLEWARE", help="be the other process")
    parser.add_argument("--folder", default="", help="where shared memory is, for the other process")
    given = parser.parse_args()
    if given.echo:
        echo(given.echo, given.folder)
        return 0
    figures = Figures(given.json)
    if find_spec("rclpy"):
        figures.row("ROS 2", **measure("ROS 2", "", given.seconds))
        return 0
    late = 0.0
    for name, found in results(given.seconds):
        figures.row(name, load=os.getloadavg()[0], **found)
        late = found["p99_ms"]
    return int(late > GOAL)


if __name__ == "__main__":
    supervise()
    sys.exit(main())

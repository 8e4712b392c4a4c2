"""Processes of a real-time layer in a namespace of their own, and the states of their robot."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from support.processes import SOURCES, until

from solfer.components.move_joints import MoveJoints, Reply
from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.plugins import PluginState
from solfer.segments.namespace import Namespace
from solfer.telemetry.statistics import RuntimeStatistics

REPOSITORY = Path(__file__).parents[3]
ROBOT = REPOSITORY / "config" / "robots" / "centauro" / "robot.yaml"
WORLD = REPOSITORY / "config" / "worlds" / "flat.yaml"
WAIT = 60.0
"""Bound of every wait, on a machine that has much else to do [s]."""

WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")
V_MAX = 30.0  # [rad/s], more than any joint of CENTAURO may

HELD = 0.06
"""How far joints that hold may move while wheels brake [rad]: their springs swing by up to 0.057."""


def insist(act: Callable[[], None], condition: Callable[[], object], what: str) -> None:
    """Do something until a condition holds that should follow from it; fails after WAIT.

    A machine that stalls the process that commands for 20 of its periods makes the lower level take the joints away.
    """
    for left in (2, 1, 0):
        act()
        try:
            return until(condition, what, WAIT / 3.0)
        except AssertionError:
            if not left:
                raise


class XbotSystem:
    """A namespace, the processes in it, and the robot's joint states.

    Attributes:
        name: Name of the namespace.
        namespace: The namespace.
        simulator: The simulator's process.
        processes: All processes that were started.
        samples: What was published: stamp [s], positions [rad] and velocities [rad/s] of all joints.
    """

    def __init__(self) -> None:
        self.name = f"test-{os.getpid()}-{time.monotonic_ns()}"
        self.namespace = Namespace(self.name)
        self.middleware = XbotMiddleware(self.namespace, "/test")
        self._queue = self.middleware.queue("joint_states", "sensor_msgs/JointState", 4096)
        self.processes: list[subprocess.Popen] = []
        self.samples: list[tuple[float, np.ndarray, np.ndarray]] = []
        self.joints: tuple[str, ...] = ()
        self.simulator: subprocess.Popen | None = None

    def start(self, path: Path, *arguments: str) -> subprocess.Popen:
        """Start a program of this repository."""
        return self._start(str(path), *arguments)

    def start_code(self, code: str) -> subprocess.Popen:
        """Start a program that a test wrote."""
        return self._start("-c", code)

    def _start(self, *arguments: str) -> subprocess.Popen:
        environment = os.environ | {
            "PYTHONPATH": f"{SOURCES}:{os.environ.get('PYTHONPATH', '')}",
            "OPENBLAS_NUM_THREADS": "1",
        }
        process = subprocess.Popen(
            [sys.executable, *arguments], env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        self.processes.append(process)
        return process

    def simulate(self) -> None:
        """Start the simulator, and wait until it publishes joint states."""
        self.simulator = self.start(
            REPOSITORY / "nodes" / "xbot_simulator",
            "--namespace",
            self.name,
            "--robot",
            str(ROBOT),
            "--world",
            str(WORLD),
        )
        until(self.look, "joint states")

    def driver(self, speed: float) -> subprocess.Popen:
        """Start a process that drives the wheels, and wait until they turn."""
        process = None

        def drive() -> None:
            nonlocal process
            if process is not None:
                process.kill()
                process.wait()
            process = self.start(Path(__file__).with_name("xbot_driver.py"), self.name, str(speed))

        insist(drive, lambda: abs(self.speed() - abs(speed)) < 0.1, "wheels that turn")
        return process

    def state(self) -> PluginState | None:
        """Stage of the first plugin of the RT layer; None without a live layer."""
        try:
            statistics = RuntimeStatistics.attach(self.namespace.folder)
        except MiddlewareError:
            return None
        return statistics.state(0) if statistics.alive else None

    def drive(self, speed: float, plugin: str = "joint_states") -> None:
        """Let a plugin turn the wheels [rad/s], and wait until they do."""
        request = MoveJoints(joints=WHEELS, velocities=(speed,) * 4)

        def asks() -> None:
            until(
                lambda: self.middleware.call(f"{plugin}/trajectory", "solfer/MoveJoints", request, Reply, WAIT).success,
                "a plugin that accepts requests",
            )

        insist(asks, lambda: abs(self.speed() - speed) < 0.1, "wheels that turn")

    def watchdog(self, *arguments: str) -> subprocess.Popen:
        """Start the watchdog."""
        return self.start(REPOSITORY / "nodes" / "xbot_watchdog", "--namespace", self.name, *arguments)

    def look(self) -> bool:
        """Receive what was published since the last call; returns whether there was anything."""
        messages = self._queue.drain()
        for message in messages:
            self.joints = message.names
            self.samples.append((message.stamp, message.position.copy(), message.velocity.copy()))
        return bool(messages)

    def speed(self) -> float:
        """Largest measured speed of a wheel [rad/s]."""
        self.look()
        places = [self.joints.index(wheel) for wheel in WHEELS]
        return float(np.abs(self.samples[-1][2][places]).max())

    def watch(self, duration: float) -> None:
        """Record `duration` [s] of simulated time."""
        self.look()
        end = self.samples[-1][0] + duration
        until(lambda: self.look() and self.samples[-1][0] >= end, "simulated time that passes")

    def rest_after(self, moment: float) -> float:
        """Compute the simulated time from `moment` until the wheels stay slow [s]; infinity: they do not."""
        places = [self.joints.index(wheel) for wheel in WHEELS]
        late = [
            stamp for stamp, _, velocity in self.samples if stamp >= moment and np.abs(velocity[places]).max() > 0.2
        ]
        if not late:
            return 0.0
        return np.inf if late[-1] == self.samples[-1][0] else late[-1] - moment

    def largest_step(self, moment: float) -> float:
        """Find the largest motion of a joint that holds its position, wheels not among them, since `moment` [rad]."""
        held = [index for index, joint in enumerate(self.joints) if joint not in WHEELS]
        before = next(position for stamp, position, _ in self.samples if stamp >= moment)
        return max(
            float(np.abs(position - before)[held].max()) for stamp, position, _ in self.samples if stamp >= moment
        )

    def close(self) -> None:
        """End all processes and remove the namespace."""
        for process in self.processes:
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(signal.SIGCONT)
            process.kill()
            process.communicate()
        self.middleware.close()
        shutil.rmtree(self.namespace.folder, ignore_errors=True)  # a test may have removed it


@contextlib.contextmanager
def system() -> Iterator[XbotSystem]:
    """Make a system, and clean it up."""
    made = XbotSystem()
    try:
        yield made
    finally:
        made.close()

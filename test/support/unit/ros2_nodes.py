"""Nodes of ROS 2 in processes of their own, and one that is not ours; needs the environment of `./run ros2`."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

REPOSITORY = Path(__file__).resolve().parents[3]
PATIENCE = 60.0
"""Longest wait for what another process does [s]."""


class Foreign:
    """A node of rclpy alone.

    Args:
        joints: Whether it reads the joints.

    Attributes:
        positions: Newest positions of the joints.
        reports: Newest status of each part in /diagnostics, by its name.
    """

    def __init__(self, joints: bool = True) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("foreign", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.positions: dict[str, float] = {}
        self.reports: dict[str, Any] = {}
        if joints:
            self.node.create_subscription(JointState, "/joint_states", self._receive, qos_profile_sensor_data)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._report, 64)

    def _receive(self, message: Any) -> None:
        self.positions = dict(zip(message.name, message.position, strict=True))

    def _report(self, message: Any) -> None:
        self.reports.update({each.name: each for each in message.status})

    def text(self, part: str) -> str:
        """Return the newest summary of a part of /diagnostics."""
        return self.reports[part].message if part in self.reports else ""

    def count(self, part: str, key: str) -> int:
        """Return a count of the next report of a part."""
        del self.reports[part]
        self.until(lambda: part in self.reports)
        return next(int(each.value) for each in self.reports[part].values if each.key == key)

    def until(self, condition: Callable[[], object]) -> None:
        """Spin until a condition holds."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, "it has not come"
            self.executor.spin_once(timeout_sec=0.05)

    def spin(self, duration: float) -> None:
        """Spin for a time [s]."""
        end = time.monotonic() + duration
        self.until(lambda: time.monotonic() >= end)

    def result(self, future: Any) -> Any:
        """Spin until a result is there."""
        self.until(future.done)
        return future.result()

    def close(self) -> None:
        """End the node."""
        self.node.destroy_node()
        self.context.shutdown()


def start(stack: ExitStack, *command: str) -> subprocess.Popen[bytes]:
    """Start a node, which ends by Ctrl-C unless it has been killed."""
    process = subprocess.Popen(
        [sys.executable, *command], cwd=REPOSITORY, stderr=subprocess.STDOUT, stdout=subprocess.PIPE
    )

    def end() -> None:
        process.send_signal(signal.SIGINT)
        output = process.communicate(timeout=30)[0].decode()
        assert process.returncode in (0, -signal.SIGKILL) and "Traceback" not in output, output

    stack.callback(end)
    return process


def configured(folder: Path) -> str:
    """Write the configuration of CENTAURO by the first command of the page, and return its file."""
    (folder / "config").mkdir()
    for each in (REPOSITORY / "config").iterdir():
        (folder / "config" / each.name).symlink_to(each)
    subprocess.run(page("sh").splitlines()[0], shell=True, cwd=folder, check=True)
    return str(folder / "config/ros2.yaml")


def page(language: str) -> str:
    """Return the block of docs/how-to/ros2.md in a language."""
    text = (REPOSITORY / "docs/how-to/ros2.md").read_text()
    return text.partition(f"```{language}\n")[2].partition("```")[0]


def start_both(stack: ExitStack, folder: Path) -> subprocess.Popen[bytes]:
    """Start the simulator and a plugin by the commands of the page; return the simulator."""
    file = configured(folder)
    commands = [line.partition("#")[0].split()[2:] for line in page("sh").splitlines()[1:3]]
    nodes = [
        start(stack, f"nodes/{name}", *words[:-1], words[-1].replace("config/ros2.yaml", file))
        for name, *words in commands
    ]
    return nodes[0]

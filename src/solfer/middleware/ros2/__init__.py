"""ROS 2: topics, services, parameters and diagnostics on rclpy.

Nothing spins for topics: the thread that reads one takes what the middleware of ROS 2 has kept for it, as packed bytes.
"""

from collections.abc import Sequence

from solfer.errors import MissingDependency

try:
    import rclpy  # noqa: F401
except ModuleNotFoundError as error:
    raise MissingDependency(
        f"this needs ROS 2, and there is no module '{error.name}'",
        expected="`./run ros2 COMMAND`, or an installed ROS 2; see docs/reference/dependencies.md",
    ) from error

from solfer.middleware.ros2.middleware import Ros2Middleware
from solfer.middleware.ros2.node import Ros2Node, argument, arguments, run_main, setting
from solfer.middleware.ros2.tf import base_transform
from solfer.process import switch


def connect(name: str, argv: Sequence[str] | None = None, publishes_time: bool = False) -> Ros2Middleware:
    """Start the node of this process, see `Ros2Node`."""
    return Ros2Middleware(Ros2Node(name, argv, publishes_time))


__all__ = [
    "Ros2Middleware",
    "Ros2Node",
    "argument",
    "arguments",
    "base_transform",
    "connect",
    "run_main",
    "setting",
    "switch",
]

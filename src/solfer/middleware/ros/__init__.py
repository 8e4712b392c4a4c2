"""ROS 1: rospy's topics and services, tf and diagnostics."""

from collections.abc import Sequence

from solfer.errors import MissingDependency

try:
    import rospy  # noqa: F401
except ModuleNotFoundError as error:
    raise MissingDependency(
        f"this needs ROS 1, and there is no module '{error.name}'",
        expected="ROS 1 and a built workspace, as ./run makes it; see docs/reference/dependencies.md",
    ) from error

from solfer.middleware.ros.middleware import RosMiddleware
from solfer.middleware.ros.node.node import RosNode, arguments, run_main
from solfer.middleware.ros.node.options import argument, setting
from solfer.middleware.ros.tf import BaseTransform, base_transform, tf_prefix
from solfer.process import switch


def connect(name: str, argv: Sequence[str] | None = None, publishes_time: bool = False) -> RosMiddleware:
    """Start the node of this process, see `RosNode`."""
    return RosMiddleware(RosNode(name, argv, publishes_time))


__all__ = [
    "BaseTransform",
    "RosNode",
    "RosMiddleware",
    "argument",
    "arguments",
    "base_transform",
    "connect",
    "run_main",
    "setting",
    "switch",
    "tf_prefix",
]

"""ROS 1: rospy's topics and services, tf and diagnostics."""

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
from solfer.middleware.ros.node.options import argument, setting, switch
from solfer.middleware.ros.tf import BaseTransform, tf_prefix

__all__ = [
    "BaseTransform",
    "RosNode",
    "RosMiddleware",
    "argument",
    "arguments",
    "run_main",
    "setting",
    "switch",
    "tf_prefix",
]

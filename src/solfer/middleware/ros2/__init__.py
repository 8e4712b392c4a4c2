"""ROS 2: topics, services, parameters and diagnostics on rclpy.

Nothing spins for topics: whoever reads a topic takes what the middleware of ROS 2 has kept for it, as packed bytes.
"""

from solfer.errors import MissingDependency

try:
    import rclpy  # noqa: F401
except ModuleNotFoundError as error:
    raise MissingDependency(
        f"this needs ROS 2, and there is no module '{error.name}'",
        expected="`./run ros2 COMMAND`, or an installed ROS 2; see docs/reference/dependencies.md",
    ) from error

from solfer.middleware.ros2.middleware import Ros2Middleware
from solfer.middleware.ros2.node import Ros2Node, arguments

__all__ = ["Ros2Middleware", "Ros2Node", "arguments"]

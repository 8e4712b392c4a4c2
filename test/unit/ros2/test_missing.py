"""`middleware: ROS2` where ROS 2 is not installed."""

import subprocess
import sys


def test_ros_2_that_is_not_installed_is_one_error():
    """Without its modules the room names the command that has them."""
    code = "import sys; sys.modules['rclpy'] = None; import solfer.middleware.ros2"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "no module 'rclpy'" in done.stderr and "./run ros2" in done.stderr

"""ROS 1: rospy's topics and services, tf and diagnostics."""

from solfer.middleware.ros.middleware import RosMiddleware
from solfer.middleware.ros.node import Node, arguments, run_main
from solfer.middleware.ros.options import argument, setting, switch
from solfer.middleware.ros.tf import BaseTransform

__all__ = ["BaseTransform", "Node", "RosMiddleware", "argument", "arguments", "run_main", "setting", "switch"]

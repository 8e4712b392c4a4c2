"""Algorithms: a Robot in, a Robot out. No pipes, no ROS, no shared memory."""

from solfer.components.base import Component
from solfer.components.declaration import Service

__all__ = ["Component", "Service"]

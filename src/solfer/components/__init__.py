"""Algorithms: a Robot in, a Robot out. No pipes, no ROS, no shared memory."""

from solfer.components.base import Component
from solfer.components.declaration import Service
from solfer.components.port import Port

__all__ = ["Component", "Port", "Service"]

"""Robot, the facade that components work on, and its builder from a configuration."""

from solfer.robot.builder import build
from solfer.robot.robot import Robot

__all__ = ["Robot", "build"]

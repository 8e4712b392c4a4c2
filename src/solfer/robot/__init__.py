"""Robot, the facade that components work on, and its builder from a configuration."""

from solfer.robot.builder import build
from solfer.robot.description.shipped import RobotFiles, robot_files
from solfer.robot.names import RobotNames, check_names
from solfer.robot.robot import Robot

__all__ = ["Robot", "RobotFiles", "RobotNames", "build", "check_names", "robot_files"]

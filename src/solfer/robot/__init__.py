"""Robot, the facade that components work on, and its builder from a configuration."""

from solfer.robot.builder import build
from solfer.robot.names import RobotNames, check_names
from solfer.robot.robot import Robot
from solfer.robot.shipped import RobotFiles, robot_files

__all__ = ["Robot", "RobotFiles", "RobotNames", "build", "check_names", "robot_files"]

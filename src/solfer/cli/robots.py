"""Robots that the options of a command name, read from files."""

import argparse

from solfer.cli.plugins import configurations_of, report_of
from solfer.errors import ConfigError
from solfer.model.srdf.semantics import Semantics
from solfer.model.urdf.description import Description
from solfer.robot.description.shipped import RobotFiles, robot_files, robot_named


def given_robot(options: argparse.Namespace) -> RobotFiles | None:
    """Return the robot of --urdf and --srdf; None without them.

    Raises:
        ConfigError: An SRDF without a URDF.
    """
    if options.urdf is None and options.srdf is not None:
        raise ConfigError("an SRDF alone is not a robot", where=str(options.srdf), expected="--urdf FILE beside --srdf")
    return None if options.urdf is None else RobotFiles(options.urdf, options.srdf)


def robot_of(options: argparse.Namespace) -> tuple[Description, Semantics]:
    """Read description and semantics of the robot that --urdf, --robot or FILE names, in this order.

    Raises:
        SolferError: None of them is given, or there are no files of that robot.
    """
    files = given_robot(options) or _named(options)
    description = Description.from_file(files.urdf)
    others = [Description.from_file(path) for path in files.others]
    semantics = Semantics() if files.srdf is None else Semantics.from_file(files.srdf, description, others)
    return description, semantics


def _named(options: argparse.Namespace) -> RobotFiles:
    if options.robot is not None:
        return robot_named(options.robot)
    if options.file is None:
        raise ConfigError(f"the {options.kind} of which robot?", expected="FILE, --robot NAME, or --urdf FILE")
    for configuration in configurations_of(report_of(options)):
        files = robot_files(configuration)
        if files is not None:
            return files
    raise ConfigError(
        "the robot of this configuration has no files here", where=options.file, expected="--urdf FILE and --srdf FILE"
    )

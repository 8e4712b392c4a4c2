"""Options that several sub-commands have."""

import argparse
from pathlib import Path


def add_file(parser: argparse.ArgumentParser, **more: str) -> None:
    """FILE, the main configuration."""
    parser.add_argument("file", metavar="FILE", help="main configuration", **more)


def add_search_paths(parser: argparse.ArgumentParser) -> None:
    """--search-path, for a configuration that was written on another machine."""
    parser.add_argument("--search-path", dest="search_paths", metavar="DIR", action="append", default=[],
                        help="folder below which files are looked for that are not where the configuration says, by "
                             "the longest tail of their paths; repeat it for several")


def add_system(parser: argparse.ArgumentParser) -> None:
    """--system, for a look at the other one."""
    parser.add_argument("--system", choices=("SM", "HW"), help="instead of the file's `system`")


def add_robot_files(parser: argparse.ArgumentParser) -> None:
    """--urdf and --srdf, for a robot that is not shipped."""
    parser.add_argument("--urdf", type=Path, metavar="FILE", help="the robot's URDF")
    parser.add_argument("--srdf", type=Path, metavar="FILE", help="the robot's SRDF")

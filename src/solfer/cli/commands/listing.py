"""List parts of a robot, pipes, plugins, configurations, or what components declare.

Joints, links, groups and states are those of the robot that FILE names, of a shipped one (--robot), or of a URDF of
your own (--urdf, --srdf). Maps, pipes, configs and declarations are those of FILE, with -n of one configuration in it.
Plugins are those that can run, and with FILE also those that its configurations bring along.
"""

import argparse

from solfer.cli.options import add_robot_files, add_search_paths, add_system

DESCRIBED = ("joints", "links", "groups", "states")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    kinds = (*DESCRIBED, "maps", "pipes", "plugins", "configs", "declarations")
    parser.add_argument("kind", metavar="KIND", choices=kinds, help=f"one of {', '.join(kinds)}")
    parser.add_argument("file", metavar="FILE", nargs="?", help="main configuration")
    parser.add_argument("-n", dest="name", metavar="NAME", help="plugin configuration in FILE")
    parser.add_argument("--robot", metavar="NAME", help="a shipped robot, such as `centauro`")
    add_robot_files(parser)
    add_search_paths(parser)
    add_system(parser)


def run(options: argparse.Namespace) -> int:
    """Print one line for each entry.

    Raises:
        SolferError: The configuration or the robot is wrong, or not enough is given.
    """
    from solfer.cli.columns import aligned

    if options.kind in DESCRIBED:
        from solfer.cli.robots import robot_of
        from solfer.cli.tables.robot import TABLES

        rows = TABLES[options.kind](*robot_of(options))
    else:
        from solfer.cli.tables.configuration import TABLES as CONFIGURED

        rows = CONFIGURED[options.kind](options)
    for line in aligned(rows):
        print(line)
    return 0

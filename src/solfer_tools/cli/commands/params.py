"""List, read, change and save parameters of plugins while they run.

With `--namespace` of an RT layer in its shared memory, else under ROS. NAME and VALUE are those of
docs/how-to/live_parameters.md, such as `stack.tasks.left.gain=8`; VALUE is YAML, and an empty one is the default.
"""

import argparse
from pathlib import Path

from solfer.cli.options import add_namespace


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="name, value, unit, range, default and description of each")
    listing.add_argument("running", nargs="?", metavar="PLUGIN", help="the plugin (default: all)")
    get = actions.add_parser("get", help="print NAME=VALUE")
    get.add_argument("running", metavar="PLUGIN", help="the plugin")
    get.add_argument("parameters", nargs="+", metavar="NAME", help="parameters")
    put = actions.add_parser("set", help="change parameters, all or none")
    put.add_argument("running", metavar="PLUGIN", help="the plugin")
    put.add_argument("parameters", nargs="+", metavar="NAME=VALUE", help="parameters and their new values")
    save = actions.add_parser(
        "save", help="write what differs from the configuration to a YAML file, for secondary_file"
    )
    save.add_argument("running", metavar="PLUGIN", help="the plugin")
    save.add_argument("file", type=Path, metavar="FILE", help="the file; where it exists only values change")
    add_namespace(parser, actions.choices.values(), "", "namespace of the RT layer (default: plugins under ROS)")


def run(options: argparse.Namespace) -> int:
    """Run the chosen action.

    Raises:
        UnknownName: There is no such namespace, plugin or parameter.
        MiddlewareError: The plugin refuses, or does not answer.
        ConfigError: The file cannot be written.
    """
    from solfer_tools.cli.params.actions import PARAMETER_ACTIONS
    from solfer_tools.cli.params.callers import caller

    with caller(options.namespace) as made:
        PARAMETER_ACTIONS[options.action](options, made)
    return 0

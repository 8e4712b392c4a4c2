"""Show the health of plugins, pipes and processes, and why: a live table, until Ctrl-C.

With `--namespace` of an RT layer in its shared memory, with the times of its cycles; else under ROS. It only reads, so
that it also works when a process hangs.
"""

import argparse

from solfer.cli.options import add_times


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument(
        "--namespace", default="", metavar="NAME", help="namespace of the RT layer (default: plugins under ROS)"
    )
    add_times(parser)


def run(options: argparse.Namespace) -> int:
    """Print the table.

    Raises:
        UnknownName: There is no such namespace.
        MiddlewareError: There is no such RT layer, or no ROS master answers.
        MissingDependency: There is no ROS.
    """
    from solfer.cli.rt.top import top_of_layer, top_of_nodes
    from solfer.realtime.namespaces import find

    if options.namespace:
        top_of_layer(options, find(options.namespace))
    else:
        top_of_nodes(options)
    return 0

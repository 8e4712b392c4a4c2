"""Look after the RT layer: a live table of its times, switch and abort plugins, the emergency stop.

`top` and `state` only look, and `estop` needs nobody who answers: they work as well when the RT process hangs.
"""

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the sub-command takes."""
    parser.add_argument("--namespace", default="solfer", help="namespace of the shared memory (default: solfer)")
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    top = actions.add_parser("top", help="how long cycles, components and stages take")
    top.add_argument("--once", action="store_true", help="print the table once instead of again and again")
    top.add_argument("--every", type=float, default=1.0, metavar="SECONDS", help="time between two tables (default: 1)")
    switch = actions.add_parser("switch", help="start and stop plugins at one cycle boundary, all or none")
    switch.add_argument("--start", nargs="+", default=[], metavar="NAME", help="plugins to start")
    switch.add_argument("--stop", nargs="+", default=[], metavar="NAME", help="plugins to stop")
    actions.add_parser("state", help="where each plugin is in its life, and why")
    abort = actions.add_parser("abort", help="let a plugin hold at once, without asking its component")
    abort.add_argument("name", metavar="NAME", help="the plugin")
    estop = actions.add_parser("estop", help="trip the emergency stop")
    estop.add_argument("reason", nargs="?", default="by command line", help="why")
    estop.add_argument("--clear", action="store_true", help="release it; refused unless all plugins are at rest")


def run(options: argparse.Namespace) -> int:
    """Do it.

    Raises:
        MiddlewareError: There is no such RT layer, or it refuses.
    """
    from solfer.cli.rt_actions import ACTIONS
    from solfer.middleware.xbot.namespace import Namespace

    ACTIONS[options.action](options, Namespace(options.namespace))
    return 0

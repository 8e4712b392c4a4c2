"""Look after the RT layer: a live table of its times, recordings, switch and abort plugins, the emergency stop.

`top`, `state` and `record` only look, and `estop` needs nobody who answers: they work as well when the RT process
hangs. `record --last` works after its end, too.
"""

import argparse
import math
from pathlib import Path


def seconds(text: str) -> float:
    """A duration [s].

    Raises:
        ArgumentTypeError: It is none.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is no time above zero")
    return value


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the sub-command takes."""
    namespace = {"metavar": "NAME", "help": "namespace of the shared memory (default: solfer)"}
    parser.add_argument("--namespace", default="solfer", **namespace)
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    top = actions.add_parser("top", help="how long cycles, components and stages take")
    top.add_argument("--once", action="store_true", help="print the table once instead of again and again")
    top.add_argument("--every", type=seconds, default=1.0, metavar="SECONDS",
                     help="time between two tables (default: 1)")
    record = actions.add_parser("record", help="write a file of what all plugins measure, want and send")
    record.add_argument("file", metavar="OUT.npz", type=Path, help="the file, for NumPy's `load`")
    length = record.add_mutually_exclusive_group()
    length.add_argument("--seconds", type=seconds, metavar="N", help="how long (default: until Ctrl-C)")
    length.add_argument("--last", action="store_true", help="what the layer has kept in memory, also after a crash")
    switch = actions.add_parser("switch", help="start and stop plugins at one cycle boundary, all or none")
    switch.add_argument("--start", nargs="+", default=[], metavar="NAME", help="plugins to start")
    switch.add_argument("--stop", nargs="+", default=[], metavar="NAME", help="plugins to stop")
    state = actions.add_parser("state", help="where each plugin is in its life, and why")
    state.add_argument("names", nargs="*", metavar="NAME", help="plugins (default: all)")
    abort = actions.add_parser("abort", help="let a plugin hold at once, without asking its component")
    abort.add_argument("name", metavar="NAME", help="the plugin")
    estop = actions.add_parser("estop", help="trip the emergency stop")
    estop.add_argument("reason", nargs="?", default="by command line", help="why")
    estop.add_argument("--clear", action="store_true", help="release it; refused unless all plugins are at rest")
    for action in actions.choices.values():
        action.add_argument("--namespace", default=argparse.SUPPRESS, **namespace)  # before or behind, as one likes
        action.set_defaults(parser=action)


def run(options: argparse.Namespace) -> int:
    """Do it.

    Raises:
        MiddlewareError: There is no such RT layer, or it refuses.
    """
    from solfer.cli.rt_actions import ACTIONS
    from solfer.middleware.xbot.namespace import Namespace

    ACTIONS[options.action](options, Namespace(options.namespace))
    return 0

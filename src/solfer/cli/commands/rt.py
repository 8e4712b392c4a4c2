"""Look after the RT layer: a live table of its times, recordings, switch and abort plugins, the emergency stop.

`top`, `state` and `record` only read: they also work when the RT process hangs. `record --last` works after its end,
too. `estop` sets a latch and waits until the layer has seen it; exit code 2: no plugin obeys, or not yet.
"""

import argparse

from solfer.cli.options import add_namespace, add_times
from solfer.cli.rt.record import add_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    add_times(actions.add_parser("top", help="as `solfer top`: health, and durations of cycles, components and stages"))
    record = actions.add_parser("record", help="write what all plugins measure, desire and send to a file")
    add_file(record)
    switch = actions.add_parser("switch", help="start and stop plugins at one cycle boundary, all or none")
    switch.add_argument("--start", nargs="+", default=[], metavar="NAME", help="plugins to start")
    switch.add_argument("--stop", nargs="+", default=[], metavar="NAME", help="plugins to stop")
    state = actions.add_parser("state", help="state of each plugin, and why")
    state.add_argument("names", nargs="*", metavar="NAME", help="plugins (default: all)")
    abort = actions.add_parser("abort", help="let a plugin hold at once, without asking its component")
    abort.add_argument("name", metavar="NAME", help="the plugin")
    estop = actions.add_parser("estop", help="trip the emergency stop")
    estop.add_argument("reason", nargs="?", default="by command line", help="why")
    estop.add_argument("--clear", action="store_true", help="release it; refused unless all plugins are at rest")
    add_namespace(parser, actions.choices.values(), "solfer", "namespace of the shared memory (default: solfer)")


def run(options: argparse.Namespace) -> int:
    """Run the chosen action.

    Raises:
        UnknownName: There is no such namespace.
        MiddlewareError: There is no such RT layer, or it refuses.
    """
    from solfer.realtime.namespaces import find

    namespace = find(options.namespace)
    if options.action == "estop" and not options.clear:
        from solfer.cli.rt.estop import trip  # nothing that takes long to import

        trip(namespace, options.reason)
    else:
        from solfer.cli.rt.actions import LAYER_ACTIONS

        LAYER_ACTIONS[options.action](options, namespace)
    return 0

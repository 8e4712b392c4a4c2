"""Actions of `solfer rt`."""

import argparse
import contextlib
import os
import sys
import time
from collections.abc import Sequence
from typing import Any

from solfer.cli.rt.record import record
from solfer.cli.rt.tables import lives, overview
from solfer.errors import MiddlewareError, UnknownName
from solfer.middleware.shared_memory.memory.namespace import Namespace
from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.realtime.telemetry.statistics_memory import EXECUTOR, RuntimeStatistics
from solfer.realtime.telemetry.summaries import StatisticsReader
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import SWITCH, TRIGGER, NoFields, SwitchRequest

PATIENCE = 2.0  # [s]
CLEAR = "\x1b[H\x1b[2J"


def top(options: argparse.Namespace, namespace: Namespace) -> None:
    """Print the table until Ctrl-C, or once. A layer that has ended may start again."""
    RuntimeStatistics.attach(namespace.folder)
    observer, since = StatisticsReader(namespace.folder), "all cycles"
    clear = CLEAR if sys.stdout.isatty() and not options.once else ""
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            layer = observer.look()
            text = "the RT layer has ended" if layer is None else "\n".join(overview(layer, since))
            print(clear + text, flush=True)
            if options.once:
                return
            time.sleep(options.every)
            since = f"the last {options.every:g} s"


def switch(options: argparse.Namespace, namespace: Namespace) -> None:
    """Start and stop plugins."""
    request = SwitchRequest(tuple(options.start), tuple(options.stop))
    _ask(namespace, f"{EXECUTOR}/switch", SWITCH, request)


def state(options: argparse.Namespace, namespace: Namespace) -> None:
    """Print the state of each plugin."""
    known = RuntimeStatistics.attach(namespace.folder).plugins
    for name in options.names:
        _require(name, known)
    layer = StatisticsReader(namespace.folder).look()
    for line in lives(plugin for plugin in layer.plugins if plugin.name in (options.names or known)):
        print(line)


def abort(options: argparse.Namespace, namespace: Namespace) -> None:
    """Abort a plugin."""
    _require(options.name, RuntimeStatistics.attach(namespace.folder).plugins)
    _ask(namespace, f"{options.name}/abort", TRIGGER, NoFields())


def clear_stop(options: argparse.Namespace, namespace: Namespace) -> None:
    """Clear the emergency stop."""
    _ask(namespace, f"{EXECUTOR}/estop_clear", TRIGGER, NoFields())


ACTIONS = {"top": top, "record": record, "switch": switch, "state": state, "abort": abort, "estop": clear_stop}


def _require(name: str, plugins: Sequence[str]) -> None:
    if name not in plugins:
        raise UnknownName("plugin", name, plugins)


def _ask(namespace: Namespace, service: str, interface: str, request: Any) -> None:
    """Call a service of the RT layer.

    Raises:
        MiddlewareError: The service does not answer, or it refuses.
    """
    with contextlib.closing(XbotMiddleware(namespace, f"solfer_rt_{os.getpid()}")) as middleware:
        answer = middleware.call(service, interface, request, Answer, PATIENCE)
    if not answer.success:
        raise MiddlewareError(answer.message)

"""Actions of `solfer rt`."""

import argparse
import contextlib
import os
from collections.abc import Sequence
from typing import Any

from solfer.cli.rt.record import record
from solfer.cli.rt.tables import lives
from solfer.cli.rt.top import top_of_layer
from solfer.errors import MiddlewareError, UnknownName
from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.realtime.emergency_stop import stopped
from solfer.segments.namespace import Namespace
from solfer.telemetry.statistics import EXECUTOR, RuntimeStatistics
from solfer.telemetry.summaries import StatisticsReader
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import SWITCH, TRIGGER, NoFields, SwitchRequest


def switch(options: argparse.Namespace, namespace: Namespace) -> None:
    """Start and stop plugins."""
    request = SwitchRequest(tuple(options.start), tuple(options.stop))
    _call(namespace, f"{EXECUTOR}/switch", SWITCH, request=request)


def state(options: argparse.Namespace, namespace: Namespace) -> None:
    """Print the state of each plugin."""
    known = RuntimeStatistics.attach(namespace.folder).plugins
    for name in options.names:
        _require(name, known)
    layer = StatisticsReader(namespace.folder, stopped).look()
    for line in lives(plugin for plugin in layer.plugins if plugin.name in (options.names or known)):
        print(line)


def abort(options: argparse.Namespace, namespace: Namespace) -> None:
    """Abort a plugin."""
    _require(options.name, RuntimeStatistics.attach(namespace.folder).plugins)
    _call(namespace, f"{options.name}/abort", TRIGGER, request=NoFields())


def clear_stop(options: argparse.Namespace, namespace: Namespace) -> None:
    """Clear the emergency stop."""
    _call(namespace, f"{EXECUTOR}/estop_clear", TRIGGER, request=NoFields())


LAYER_ACTIONS = {
    "top": top_of_layer,
    "record": record,
    "switch": switch,
    "state": state,
    "abort": abort,
    "estop": clear_stop,
}


def _require(name: str, plugins: Sequence[str]) -> None:
    if name not in plugins:
        raise UnknownName("plugin", name, plugins)


def _call(namespace: Namespace, service: str, interface: str, request: Any) -> None:
    """Call a service of the RT layer.

    Raises:
        MiddlewareError: The service does not answer, or it refuses.
    """
    with contextlib.closing(XbotMiddleware(namespace, f"solfer_rt_{os.getpid()}")) as middleware:
        answer = middleware.call(service, interface, request, Answer, 2.0)
    if not answer.success:
        raise MiddlewareError(answer.message)

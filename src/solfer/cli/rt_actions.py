"""What `solfer rt` does."""

import argparse
import contextlib
import os
import time
from typing import Any

from solfer.cli.columns import aligned
from solfer.cli.rt_table import heading, rows, states
from solfer.errors import MiddlewareError, UnknownName
from solfer.lower_level.services import SwitchRequest
from solfer.middleware.xbot.board import Board
from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.middleware import XbotMiddleware
from solfer.middleware.xbot.namespace import Namespace
from solfer.middleware.xbot.switchboard import EXECUTOR, SWITCH, TRIGGER
from solfer.pipes.lower_level import Answer
from solfer.pipes.middleware import NoFields

PATIENCE = 2.0  # [s]
CLEAR = "\x1b[H\x1b[2J"


def top(options: argparse.Namespace, namespace: Namespace) -> None:
    """Print the table until Ctrl-C, or once."""
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            board = Board.attach(namespace.folder)  # anew: the executor may be another one by now
            text = "\n".join((*heading(board, EmergencyStop(namespace.folder).reason), *aligned(rows(board))))
            print(text if options.once else CLEAR + text, flush=True)
            if options.once:
                return
            time.sleep(options.every)


def switch(options: argparse.Namespace, namespace: Namespace) -> None:
    """Start and stop plugins."""
    request = SwitchRequest(tuple(options.start), tuple(options.stop))
    _ask(namespace, f"{EXECUTOR}/switch", SWITCH, request)


def state(options: argparse.Namespace, namespace: Namespace) -> None:
    """Print where each plugin is in its life."""
    for line in aligned(states(Board.attach(namespace.folder))):
        print(line)


def abort(options: argparse.Namespace, namespace: Namespace) -> None:
    """Abort a plugin."""
    plugins = Board.attach(namespace.folder).plugins
    if options.name not in plugins:
        raise UnknownName("plugin", options.name, plugins)
    _ask(namespace, f"{options.name}/abort", TRIGGER, NoFields())


def estop(options: argparse.Namespace, namespace: Namespace) -> None:
    """Trip the emergency stop, or clear it."""
    if options.clear:
        _ask(namespace, f"{EXECUTOR}/estop_clear", TRIGGER, NoFields())
    else:
        EmergencyStop(namespace.folder).trip(options.reason)


ACTIONS = {"top": top, "switch": switch, "state": state, "abort": abort, "estop": estop}


def _ask(namespace: Namespace, service: str, interface: str, request: Any) -> None:
    """Ask a service of the RT layer.

    Raises:
        MiddlewareError: Nobody answers, or the answer is no.
    """
    with contextlib.closing(XbotMiddleware(namespace, f"solfer_rt_{os.getpid()}")) as middleware:
        answer = middleware.call(service, interface, request, Answer, PATIENCE)
    if not answer.success:
        raise MiddlewareError(answer.message)

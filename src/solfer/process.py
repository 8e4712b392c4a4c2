"""The process of a node without ROS: its end, its log, and its errors."""

import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType

from solfer.errors import SolferError

logger = logging.getLogger(__name__)

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


SIGNAL_POLL_PERIOD = 0.1
"""Time between two looks at the handlers, which take 10 us [s]."""


class ProcessEnd:
    """Makes Ctrl-C, SIGTERM and a closed terminal a request to end the process; a second one ends it at once.

    A component that replaces the handlers does not keep the process from ending: `running` takes them back, and lets
    the signals through. A child that a component has forked ends there, where it would else go on as a second process.
    `close` restores the earlier handlers.

    Args:
        on_request: Called at the request.
    """

    def __init__(self, on_request: Callable[[], None] = lambda: None):
        self._requested = False
        self._on_request = on_request
        self._process = os.getpid()
        self._next_look = -float("inf")
        self._handler = self._on_signal  # one object, to be recognised
        self._before = {number: signal.signal(number, self._handler) for number in SIGNALS}
        self._main = threading.current_thread()

    def running(self) -> bool:
        """Return False as soon as the end was requested."""
        if self._requested:
            return False
        if os.getpid() != self._process:
            os._exit(1)
        now = time.monotonic()
        if now > self._next_look:
            self._next_look = now + SIGNAL_POLL_PERIOD
            self._take_back()
        return True

    def _take_back(self) -> None:
        """Take the signals back from handlers of others; only the main thread may."""
        if threading.current_thread() is not self._main:
            return
        if all(signal.getsignal(number) is self._handler for number in SIGNALS):
            return
        for number in SIGNALS:
            signal.signal(number, self._handler)
        logger.warning("the signals that end this process were handled by others, and are not any more")

    def close(self) -> None:
        """Restore the earlier signal handlers."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self._requested = True
        self._on_request()
        for each in SIGNALS:
            signal.signal(each, signal.SIG_DFL)


def run_main(main: Callable[[list[str]], int]) -> None:
    """Run a node's `main` on the process' arguments and exit with its code; an error is printed in one block.

    Arguments that roslaunch adds, `__name:=xbot` and remappings of topics, are left out.
    """
    run_process(main, [argument for argument in sys.argv[1:] if ":=" not in argument])


def switch(text: str) -> bool:
    """Convert 'true' or 'false', as launch files write them.

    Raises:
        ValueError: The text is something else.
    """
    values = {"true": True, "1": True, "false": False, "0": False}
    if text.lower() not in values:
        raise ValueError("true or false")
    return values[text.lower()]


def run_process(main: Callable[[list[str]], int], argv: list[str]) -> None:
    """Run a node's `main` on arguments and exit with its code; an error is printed in one block."""
    logging.basicConfig(level=logging.INFO, format="[%(levelname)s] [%(name)s]: %(message)s", stream=sys.stdout)
    try:
        code = main(argv)
    except KeyboardInterrupt:  # before the process set its signal handlers
        code = 128 + signal.SIGINT
    except SolferError as error:
        code = error.exit_code
        sys.stdout.flush()
        print(f"error: {error}", file=sys.stderr)
    sys.exit(code)

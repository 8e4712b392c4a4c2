"""The process of a node without ROS: how it ends, what it logs, and how its errors are told."""

import logging
import signal
import sys
from collections.abc import Callable
from types import FrameType

from solfer.errors import SolferError

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Ending:
    """Ctrl-C, SIGTERM and a closed terminal ask the process to end; a second one ends it at once.

    Who goes on afterwards closes it: the process is as before.

    Args:
        asked: Called when somebody asks.
    """

    def __init__(self, asked: Callable[[], None] = lambda: None):
        self._asked, self._tell = False, asked
        self._before = {number: signal.signal(number, self._on_signal) for number in SIGNALS}

    def running(self) -> bool:
        """False as soon as somebody asked for the end."""
        return not self._asked

    def close(self) -> None:
        """Leave the signals to whom they were left before."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self._asked = True
        self._tell()
        for each in SIGNALS:
            signal.signal(each, signal.SIG_DFL)


def run_main(main: Callable[[list[str]], int]) -> None:
    """Run a node's `main` on the process' arguments and exit with its code; an error is printed in one block.

    What roslaunch adds to the arguments, such as `__name:=xbot`, is left out.
    """
    logging.basicConfig(level=logging.INFO, format="[%(levelname)s] [%(name)s]: %(message)s", stream=sys.stdout)
    try:
        code = main([argument for argument in sys.argv[1:] if not argument.startswith("__")])
    except KeyboardInterrupt:  # before the process took the signals over
        code = 128 + signal.SIGINT
    except SolferError as error:
        code = error.exit_code
        sys.stdout.flush()
        print(f"error: {error}", file=sys.stderr)
    sys.exit(code)

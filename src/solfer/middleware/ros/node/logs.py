"""solfer's log records on the terminal and on /rosout, in the form of rospy's own."""

import copy
import io
import logging
import sys


class OneLine(logging.Handler):
    """Passes records to rospy's handlers, each message on one line."""

    def emit(self, record: logging.LogRecord) -> None:
        """Pass a record on."""
        flat = copy.copy(record)
        flat.msg, flat.args = "; ".join(line.strip() for line in record.getMessage().splitlines()), None
        for handler in logging.getLogger("rosout").handlers:
            handler.handle(flat)


def connect_logs() -> None:
    """Send solfer's records to the terminal and to /rosout; rospy's root logger writes them into the log file."""
    # Under roslaunch the output is a pipe; without this, messages come out when its buffer is full.
    if isinstance(sys.stdout, io.TextIOWrapper):  # a notebook or a test may have replaced it
        sys.stdout.reconfigure(line_buffering=True)
    ours = logging.getLogger("solfer")
    if ours.level == logging.NOTSET:
        ours.setLevel(logging.INFO)
    ours.handlers[:] = [OneLine()]

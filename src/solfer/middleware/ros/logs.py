"""solfer's log records on the terminal and on /rosout, in the form of rospy's own."""

import logging
import sys


def connect_logs() -> None:
    """Give solfer's records to rospy's handlers: the terminal, /rosout, and (by the root logger) the log file."""
    # Under roslaunch the output is a pipe; without this, messages come out when its buffer is full.
    sys.stdout.reconfigure(line_buffering=True)
    ours = logging.getLogger("solfer")
    ours.setLevel(logging.INFO)
    ours.handlers[:] = logging.getLogger("rosout").handlers

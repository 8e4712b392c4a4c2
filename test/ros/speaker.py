"""A node that publishes for its parent process: pickled `(topic, kind, messages)` on stdin, then a line on stdout.

It is called `python speaker.py NAME`, and ends with its stdin.
"""

import pickle
import sys
import time
from contextlib import closing

from solfer.middleware.ros import RosMiddleware, RosNode

PATIENCE = 60.0
"""Longest wait for a subscriber [s]."""

GAP = 0.002
"""Time between two messages, so that each one arrives by itself [s]."""


def main() -> None:
    """Publish until the input ends."""
    writers = {}
    with closing(RosMiddleware(RosNode(sys.argv[1]))) as middleware:
        while True:
            try:
                topic, kind, messages = pickle.load(sys.stdin.buffer)
            except EOFError:
                return
            if topic not in writers:
                writers[topic] = middleware.writer(topic, kind)
                end = time.monotonic() + PATIENCE
                while not writers[topic].topic_publisher.has_subscribers() and time.monotonic() < end:
                    time.sleep(0.005)
            for message in messages:
                writers[topic].write(message)
                time.sleep(GAP)
            print("published", flush=True)


if __name__ == "__main__":
    main()

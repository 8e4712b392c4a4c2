#!/usr/bin/env python3
"""The contract of pipes (test/unit/pipes/test_pipe_contract.py) on ROS: publishers are processes."""

import os
import pickle
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent
SUITE = FOLDER.parent / "unit" / "pipes" / "test_pipe_contract.py"
sys.path.insert(0, str(FOLDER.parent))

from support.unit.wires import Wire  # noqa: E402
from system import SOAKS  # noqa: E402

from solfer.middleware.ros import RosMiddleware, RosNode, arguments  # noqa: E402

OUTPUT = "--gtest_output=xml:"
"""Argument of rostest for the path of the results."""

DAILY = [] if SOAKS else ["-k", "not (restarted_sender or two_senders) or joint"]
"""Tests that start one more process, which takes seconds, are run for one kind of pipe."""


class Senders:
    """Processes that publish, by the name of their node."""

    def __init__(self):
        self._processes: dict[str, subprocess.Popen] = {}

    def publish(self, sender, topic, kind, messages):
        """Publish by one of them; it is started if need be."""
        process = self._processes.get(sender) or self._start(sender)
        pickle.dump((topic, kind, messages), process.stdin)
        process.stdin.flush()
        assert process.stdout.readline(), f"{sender} has ended"

    def kill(self, sender):
        """Kill one of them."""
        process = self._processes.pop(sender)
        process.kill()
        process.communicate()

    def close(self):
        """Kill all of them."""
        for sender in tuple(self._processes):
            self.kill(sender)

    def _start(self, sender):
        command = [sys.executable, str(FOLDER / "speaker.py"), sender]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=os.environ)
        self._processes[sender] = process
        return process


class RosWire(Wire):
    """This process subscribes; time is real."""

    def __init__(self, middleware, senders):
        self.middleware, self._senders = middleware, senders

    def say(self, sender, topic, kind, *messages):
        """See `MemoryWire.say`."""
        self._senders.publish(sender, topic, kind, messages)

    def kill(self, sender):
        """See `MemoryWire.kill`."""
        self._senders.kill(sender)

    def pass_time(self, duration):
        """See `MemoryWire.pass_time`."""
        time.sleep(duration)


class Plugin:
    """Hands the wire of ROS to the suite."""

    def __init__(self, middleware, senders):
        self._parts = middleware, senders

    def pytest_configure(self, config):
        """See pytest."""
        config.wire = lambda: RosWire(*self._parts)


def main() -> int:
    """Run the suite, and leave the results where rostest looks for them."""
    results = [argument.removeprefix(OUTPUT) for argument in arguments(sys.argv) if argument.startswith(OUTPUT)]
    options = [f"--junitxml={path}" for path in results]
    with closing(RosMiddleware(RosNode("listener"))) as middleware, closing(Senders()) as senders:
        return pytest.main([str(SUITE), "-q", *DAILY, *options], plugins=[Plugin(middleware, senders)])


if __name__ == "__main__":
    sys.exit(main())

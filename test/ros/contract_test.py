#!/usr/bin/env python3
"""What holds for every pipe of every middleware (test/unit/test_pipe_contract.py), on ROS: speakers are processes."""

import os
import pickle
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent
SUITE = FOLDER.parent / "unit" / "test_pipe_contract.py"
sys.path.insert(0, str(SUITE.parent))

from wires import Wire  # noqa: E402

from solfer.middleware.ros import Node, RosMiddleware, arguments  # noqa: E402

OUTPUT = "--gtest_output=xml:"
"""Argument by which rostest says where the results go."""


class Speakers:
    """Processes that speak, by the name of their node."""

    def __init__(self):
        self._processes: dict[str, subprocess.Popen] = {}

    def say(self, sender, topic, kind, messages):
        """One of them speaks; it is started if need be."""
        process = self._processes.get(sender) or self._start(sender)
        pickle.dump((topic, kind, messages), process.stdin)
        process.stdin.flush()
        assert process.stdout.readline(), f"{sender} has ended"

    def kill(self, sender):
        """One of them ends without a goodbye."""
        process = self._processes.pop(sender)
        process.kill()
        process.communicate()

    def close(self):
        """All end."""
        for sender in tuple(self._processes):
            self.kill(sender)

    def _start(self, sender):
        command = [sys.executable, str(FOLDER / "speaker.py"), sender]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=os.environ)
        self._processes[sender] = process
        return process


class RosWire(Wire):
    """This process listens; time is real."""

    def __init__(self, middleware, speakers):
        self.middleware, self._speakers = middleware, speakers

    def say(self, sender, topic, kind, *messages):
        """See `MemoryWire.say`."""
        self._speakers.say(sender, topic, kind, messages)

    def kill(self, sender):
        """See `MemoryWire.kill`."""
        self._speakers.kill(sender)

    def pass_time(self, duration):
        """See `MemoryWire.pass_time`."""
        time.sleep(duration)


class Plugin:
    """Hands the wire of ROS to the suite."""

    def __init__(self, middleware, speakers):
        self._parts = middleware, speakers

    def pytest_configure(self, config):
        """See pytest."""
        config.wire = lambda: RosWire(*self._parts)


def main() -> int:
    """Run the suite, and leave the results where rostest looks for them."""
    results = [argument.removeprefix(OUTPUT) for argument in arguments(sys.argv) if argument.startswith(OUTPUT)]
    options = [f"--junitxml={path}" for path in results]
    with closing(RosMiddleware(Node("listener"))) as middleware, closing(Speakers()) as speakers:
        return pytest.main([str(SUITE), "-q", *options], plugins=[Plugin(middleware, speakers)])


if __name__ == "__main__":
    sys.exit(main())

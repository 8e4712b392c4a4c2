"""Runs ROS's own command line tools."""

import re
import signal
import subprocess
from itertools import islice

import yaml
from system import START, end, started

LINES = 1000
"""Lines of a tool that goes on without end, in which what is looked for has to be."""


def output(*command: str) -> str:
    """Return the output of a command; it has to succeed and to print nothing on stderr."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=START, check=False)
    if done.returncode or done.stderr:
        raise AssertionError(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def shown(*command: str) -> object:
    """Return the first YAML document that a command prints."""
    return next(yaml.safe_load_all(output(*command)))


def found(pattern: str, *command: str) -> re.Match:
    """Find the first match of a pattern in the endless output of a command; then the command is ended."""
    text = ""
    with started("timeout", "-s", "INT", f"{START:g}", *command, PYTHONUNBUFFERED="1") as process:
        for line in islice(process.stdout, LINES):
            text += line
            if match := re.search(pattern, text):
                end(process, signal.SIGINT, START)  # `timeout` hands it on
                return match
    raise AssertionError(f"{' '.join(command)}: no '{pattern}' in\n{text}")

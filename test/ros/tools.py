"""Runs ROS's own command line tools."""

import re
import subprocess
from itertools import islice

from system import START, started

LINES = 1000
"""Lines of a tool that goes on without end, in which what is looked for has to be."""


def output(*command: str) -> str:
    """What a command prints; it has to succeed and to keep quiet on stderr."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=START, check=False)
    if done.returncode or done.stderr:
        raise AssertionError(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def found(pattern: str, *command: str) -> re.Match:
    """The first match of a pattern in what a command prints that goes on without end; then the command is ended."""
    text = ""
    with started("timeout", "-s", "INT", f"{START:g}", *command, PYTHONUNBUFFERED="1") as process:
        for line in islice(process.stdout, LINES):
            text += line
            if match := re.search(pattern, text):
                return match
    raise AssertionError(f"{' '.join(command)}: no '{pattern}' in\n{text}")

"""The `solfer` command, with all its sub-commands."""

import argparse
import os
from collections.abc import Sequence

from solfer.cli import main as trunk
from solfer.cli.main import COMMANDS

ALL_COMMANDS = {
    "check": COMMANDS["check"],
    "show": COMMANDS["show"],
    "list": COMMANDS["list"],
    "graph": "solfer_tools.cli.commands.graph",
    "launch": "solfer_tools.cli.commands.launch",
    "new": "solfer_tools.cli.commands.new",
    "cut": "solfer_tools.cli.commands.cut",
    "rt": COMMANDS["rt"],
    "params": "solfer_tools.cli.commands.params",
    "policy": "solfer_tools.cli.commands.policy",
    "scenario": "solfer_tools.cli.commands.scenario",
    "study": "solfer_tools.cli.commands.study",
    "top": "solfer_tools.cli.commands.top",
    "view": "solfer_tools.cli.commands.view",
    "record": COMMANDS["record"],
    "compare": "solfer_tools.cli.commands.recordings.compare",
    "plot": "solfer_tools.cli.commands.recordings.plot",
    "replay": "solfer_tools.cli.commands.recordings.replay",
    "log": "solfer_tools.cli.commands.recordings.log",
    "allocations": "solfer_tools.cli.commands.allocations",
    "completion": "solfer_tools.cli.commands.completion",
}
"""Modules of the sub-commands, in the order of the help."""


def parser() -> argparse.ArgumentParser:
    """Build the parser of the whole command line."""
    return trunk.parser(ALL_COMMANDS)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; see `solfer.cli.main.main`."""
    if "_ARGCOMPLETE" in os.environ:
        from solfer_tools.cli.completion import complete

        complete(parser())
    return trunk.main(arguments, ALL_COMMANDS)

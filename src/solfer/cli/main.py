"""The `solfer` command.

A sub-command is a module of this package: the first line of its docstring is its help, `add_arguments(parser)` declares
what it takes, and `run(options)` does it and returns the exit code. Its own imports stand in `run`, so that one
sub-command does not wait for what another one needs.
"""

import argparse
import sys
from collections.abc import Sequence

from solfer.cli import cut
from solfer.errors import SolferError

COMMANDS = {"cut": cut}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with `arguments` (default: those of the process); 2 after an error, which goes to stderr."""
    parser = argparse.ArgumentParser(prog="solfer", description="Tools for robots and their configurations.")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, module in COMMANDS.items():
        summary = module.__doc__.splitlines()[0]
        command = commands.add_parser(name, help=summary, description=summary)
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    options = parser.parse_args(arguments)
    try:
        return options.run(options)
    except SolferError as error:
        print(f"solfer: {error}", file=sys.stderr)
        return error.exit_code

"""The `solfer` command, with the sub-commands of the trunk; `solfer_tools.cli.main` adds its own.

A sub-command is a module: the first line of its docstring is its help, `add_arguments(parser)` declares
its arguments, and `run(options)` does the work and returns the exit code. Where it has sub-commands of its own, each
sets `parser` to its own, which prints the usage after a mistake. Imports that only one sub-command needs stand in its
`run`, so that the others start without them.
"""

import argparse
import io
import os
import re
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from typing import NoReturn

from solfer.errors import SolferError, nearest, singles

COMMANDS = {
    "check": "solfer.cli.commands.check",
    "show": "solfer.cli.commands.show",
    "list": "solfer.cli.commands.listing",
    "rt": "solfer.cli.commands.rt",
    "record": "solfer.cli.rt.record",
}
"""Modules of the sub-commands."""


class CommandParser(argparse.ArgumentParser):
    """Parses the words of a command, and names those that are nearest to a wrong one."""

    def error(self, message: str) -> NoReturn:
        """Print the usage and an error, and exit with 2."""
        wrong = re.search(r"invalid choice: '(.*)' \(choose from (.*)\)", message)
        close = nearest(wrong[1], re.findall(r"[^\s',]+", wrong[2])) if wrong else []
        super().error(f"{message}\n  did you mean: {', '.join(close)}?" if close else message)


def main(arguments: Sequence[str] | None = None, commands: Mapping[str, str] = COMMANDS) -> int:
    """Run the command with `arguments` (default: those of the process); 2 after an error, which goes to stderr."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    _open_streams()
    try:
        try:
            return _run(words, commands)
        finally:
            sys.stdout.flush()
    except BrokenPipeError:  # the reader, such as `head`, has ended
        code = 141  # that a shell reports for a process that SIGPIPE ended
    except OSError as error:  # such as a full disk behind the output
        failure = SolferError(
            error.strerror or str(error),
            where=error.filename or "standard output",
            expected="a file or stream that can be read and written",
        )
        with suppress(OSError):  # the errors go there, too
            print(f"error: {failure}", file=sys.stderr)
        code = failure.exit_code
    for stream in (sys.stdout, sys.stderr):  # what is left to be written, at which Python would fail once more
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return code


def _open_streams() -> None:
    """Open streams that the caller has closed, as nowhere: a file would take their numbers; and write what they can."""
    while (nowhere := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(nowhere)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def _run(words: Sequence[str], commands: Mapping[str, str]) -> int:
    """Run a command; see `main`."""
    # a parser of one command is there in a fifth of the time: an emergency stop waits for it
    known = {words[0]: commands[words[0]]} if words and words[0] in commands else commands
    options, unknown = parser(known).parse_known_args(words)
    if unknown:  # the sub-command prints its usage; the root's parser knows only the names of commands
        options.parser.error(f"unrecognized arguments: {' '.join(unknown)}")
    try:
        return options.run(options)
    except SolferError as error:
        sys.stdout.flush()
        errors = list(singles((error,)))
        shown = 20  # of the errors of one input
        for single in errors[:shown]:
            print(f"error: {single}", file=sys.stderr)
        if len(errors) > shown:
            print(f"error: {len(errors) - shown} errors more", file=sys.stderr)
        return error.exit_code


def parser(modules: Mapping[str, str] = COMMANDS) -> argparse.ArgumentParser:
    """Build the parser of the command line, with some of the sub-commands."""
    parser = CommandParser(
        prog="solfer",
        description="Tools for robots and their configurations. None but `params` and `top` need a ROS master.",
    )
    group = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, path in modules.items():
        module = import_module(path)
        summary, _, text = (module.__doc__ or "").partition("\n")
        command = group.add_parser(
            name, help=summary, description=f"{summary}\n{text}".strip(),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )  # fmt: skip
        module.add_arguments(command)
        command.set_defaults(run=module.run, parser=command)
    return parser

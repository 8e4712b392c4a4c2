"""Completion of a command line of `solfer`, by argcomplete."""

import argparse
import os
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

from argcomplete import CompletionFinder
from argcomplete.completers import FilesCompleter

from solfer.errors import SolferError


def complete(parser: argparse.ArgumentParser) -> None:
    """Answer a shell that completes a command line, and end the program; else do nothing."""
    finder(parser)(parser)


def finder(parser: argparse.ArgumentParser) -> CompletionFinder:
    """Return what finds completions: each argument of the parser gets its own values."""
    for action in _actions(parser):
        if action.choices is None and action.nargs != 0:
            action.completer = _completer(action)  # type: ignore[attr-defined]  # argcomplete's own
    return CompletionFinder(parser, always_complete_options=False)


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield the arguments of a parser and of all its sub-commands."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
        else:
            yield action


def _completer(action: argparse.Action) -> Callable[..., Iterable[str]]:
    if action.dest == "robot":
        return lambda **_: _robots()
    if action.dest in ("name", "names", "start", "stop", "plugins", "plugin"):
        return lambda parsed_args, **_: _names(parsed_args)
    if action.dest in ("running", "parameters"):
        return partial(_live, action.dest)
    endings = {"file": "yaml", "urdf": "urdf", "srdf": "srdf"}
    return FilesCompleter(endings.get(action.dest, ()))


def _robots() -> Iterable[str]:
    from solfer.robot.description.shipped import robots_beside

    return robots_beside(os.curdir)


def _names(parsed: argparse.Namespace) -> Iterable[str]:
    """Return the configurations in the file of a command line; without one the plugins that there are."""
    from solfer.config import module_names
    from solfer.plugins import Registry

    files = [each for each in vars(parsed).values() if str(each).endswith(".yaml")]
    try:
        return module_names(str(files[-1])) if files else Registry().names()
    except SolferError:
        return ()


def _live(dest: str, parsed_args: argparse.Namespace, **_: Any) -> Iterable[str]:
    from solfer_tools.cli.params.actions import names

    return names(dest, getattr(parsed_args, "namespace", None) or "", getattr(parsed_args, "running", ""))

"""Completion of a command line of `solfer`."""

import argparse
import glob
import os
from collections.abc import Iterable, Sequence

from solfer.errors import SolferError

BASH_SCRIPT = """_solfer() {
  local IFS=$'\\n'
  COMPREPLY=($(solfer completion -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null))
  [[ ${#COMPREPLY[@]} -ne 1 || ${COMPREPLY[0]} != */ ]] || compopt -o nospace
}
complete -F _solfer solfer
"""
"""Makes bash ask `solfer completion`; after a folder there is no space."""

ENDINGS = {"file": ".yaml", "urdf": ".urdf", "srdf": ".srdf"}
"""Ending of the files that an argument names."""


def candidates(parser: argparse.ArgumentParser, words: Sequence[str]) -> list[str]:
    """Return what the last word may become, sorted.

    Args:
        parser: The parser of the command line.
        words: The words behind the name of the program, the last one as far as it was typed.
    """
    *before, word = words
    command, rest = _command(parser, before)
    action = _action(command, rest)
    if action is None:
        found: Iterable[str] = _options(command)
    else:
        found = _values(action, word, before)
        if word.startswith("-"):
            found = (*found, *_options(command))
    return sorted({each for each in found if each.startswith(word)})


def _command(parser: argparse.ArgumentParser, words: Sequence[str]) -> tuple[argparse.ArgumentParser, list[str]]:
    """Return the parser of the sub-command that some words begin with, and the words behind its name."""
    rest = list(words)
    while rest and (commands := _commands(parser)) is not None and rest[0] in commands:
        parser = commands[rest.pop(0)]
    return parser, rest


def _commands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser] | None:
    found = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return next((action.choices for action in found), None)


def _options(parser: argparse.ArgumentParser) -> list[str]:
    return [name for action in parser._actions for name in action.option_strings if name.startswith("--")]


def _action(parser: argparse.ArgumentParser, words: Sequence[str]) -> argparse.Action | None:
    """Return the argument that the word behind `words` belongs to."""
    named = {name: action for action in parser._actions for name in action.option_strings}
    positional = [action for action in parser._actions if not action.option_strings]
    waits: argparse.Action | None = None
    for word in words:
        if word in named:
            waits = named[word] if named[word].nargs != 0 else None
        elif waits is not None:
            waits = waits if waits.nargs in ("*", "+") else None
        elif positional and positional[0].nargs not in ("*", "+"):
            positional.pop(0)
    return waits or next(iter(positional), None)


def _values(action: argparse.Action, word: str, before: Sequence[str]) -> Iterable[str]:
    """Return the values that an argument may have."""
    if action.choices is not None:
        return [str(choice) for choice in action.choices]
    if action.dest == "robot":
        from solfer.robot.shipped import robots_beside

        return robots_beside(os.curdir)
    if action.dest in ("name", "names", "start", "stop", "plugins", "plugin"):
        return _names([each for each in before if each.endswith(".yaml")])
    if action.dest in ("running", "parameters"):
        from solfer.cli.params.actions import names

        return names(before, action.dest)
    return _files(word, ENDINGS.get(action.dest, ""))


def _names(files: Sequence[str]) -> Iterable[str]:
    """Return the configurations in the file of a command line; without one the plugins that there are."""
    from solfer.config import module_names
    from solfer.plugins import Registry

    try:
        return module_names(files[-1]) if files else Registry().names()
    except SolferError:
        return ()


def _files(word: str, ending: str) -> list[str]:
    """Return the files with an ending, and the folders, that begin with a word."""
    found = glob.glob(f"{glob.escape(word)}*")
    return [
        f"{each}/" if os.path.isdir(each) else each for each in found if os.path.isdir(each) or each.endswith(ending)
    ]

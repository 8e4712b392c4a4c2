"""Check the arguments of the launch file of a figure of the paper.

roslaunch ignores arguments that it does not know, and takes any value. The launch files start this command, which
looks at the command line of the roslaunch that runs it, too.
"""

import argparse
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from solfer.cli.options import Number, rate_number
from solfer.errors import SolferError, SolferErrors, UnknownName, raise_all

FIGURES = range(1, 6)

SWITCHES = ("gui", "lockstep")
"""Arguments that are read without regard to case, as roslaunch does."""

OTHERS = ("world", "record", "rates", "config", "robot", "merging", "namespace")
"""What else the launch files know; `merging` only that of Fig. 4."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("figure", metavar="N", type=int, choices=FIGURES, help="number of the figure, 1 to 5")
    parser.add_argument("arguments", metavar="NAME:=VALUE", nargs="*", help="arguments of its launch file")


def run(options: argparse.Namespace) -> int:
    """Print the number, if all arguments are right.

    Raises:
        SolferErrors: Some are not.
    """
    launch = f"figure_{options.figure}.launch"
    errors = check(options.figure, dict(split(options.arguments)), launch)
    given = dict(split(started(os.getppid(), launch)))
    errors += [error for name in given if (error := unknown(options.figure, name, launch)) is not None]
    raise_all(errors)
    print(options.figure)
    return 0


def split(arguments: Iterable[str]) -> list[tuple[str, str]]:
    """Return names and values of those that are `name:=value`; names of ROS, with underscores, are left out."""
    parts = (each.partition(":=") for each in arguments)
    return [(name, value) for name, sign, value in parts if sign and not name.startswith("_")]


def started(process: int, launch: str) -> list[str]:
    """Return the command line of a process, behind the launch file; empty if it does not run that file itself."""
    try:
        words = Path(f"/proc/{process}/cmdline").read_text(errors="replace").split("\0")
    except OSError:
        return []
    places = [index for index, word in enumerate(words) if Path(word).name == launch]
    return words[places[0] :] if places else []


def choices() -> dict[str, tuple[str, ...]]:
    """Return the arguments with few values."""
    # imported here: the command starts before anything else does
    from solfer.config.records.middlewares import MIDDLEWARES

    return {
        "middleware": tuple(MIDDLEWARES),
        "system": ("SM", "HW"),
        **dict.fromkeys(SWITCHES, ("true", "false")),
    }


def numbers() -> dict[str, Number]:
    """Return the arguments that are numbers; empty: not told."""
    return {
        "rate": rate_number(),
        "factor": Number(0.01, 1000.0, "simulated seconds for each second", zero=True),
    }


def unknown(figure: int, name: str, launch: str) -> SolferError | None:
    """Return what is wrong with the name of an argument; None: nothing."""
    known = [*choices(), *numbers(), *OTHERS]
    if figure != 4:
        known.remove("merging")
    return None if name in known else UnknownName("argument", name, known, where=launch)


def check(figure: int, given: Mapping[str, str], launch: str) -> list[SolferError]:
    """Find what is wrong with arguments, by themselves and together."""
    errors: list[SolferError] = []
    values, bounds = choices(), numbers()
    for name, value in given.items():
        where = f"{launch}, {name}:={value}"
        if (problem := unknown(figure, name, launch)) is not None:
            errors.append(problem)
        elif name in values:
            lower = value.lower() if name in SWITCHES else value
            if lower not in values[name]:
                errors.append(UnknownName(f"value of {name}", value, values[name], where=where))
        elif name in bounds and value:
            try:
                bounds[name](value)
            except argparse.ArgumentTypeError as error:
                what, _, expected = str(error).partition(", expected ")
                errors.append(SolferError(f"{name} is {what}", where=where, expected=expected))
    if (name := given.get("namespace", "")) and not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII):
        wanted = "a letter, then letters, digits and underscores"
        errors.append(SolferError(f"'{name}' is no namespace", where=f"{launch}, namespace", expected=wanted))
    return errors + _of_files(given, launch) + _together(given, launch)


def _of_files(given: Mapping[str, str], launch: str) -> list[SolferError]:
    """Find what is wrong with the world, the configuration and the place of a recording."""
    from solfer.simulation.world.world import find_world, read_world

    errors: list[SolferError] = []
    try:
        read_world(find_world(given.get("world", "flat")))
    except SolferErrors as error:
        errors += error.errors
    except SolferError as error:
        errors.append(error)
    if (file := given.get("config", "")) and not Path(file).is_file():
        errors.append(SolferError(f"there is no file '{file}'", where=f"{launch}, config", expected="a configuration"))
    if (file := given.get("record", "")) and not Path(file).absolute().parent.is_dir():
        what = f"there is no folder '{Path(file).parent}'"
        errors.append(SolferError(what, where=f"{launch}, record", expected="a file in a folder that is there"))
    return errors


def _together(given: Mapping[str, str], launch: str) -> list[SolferError]:
    """Find arguments that exclude each other."""
    from solfer.config.records.middlewares import DEFAULT, MIDDLEWARES

    middleware = given.get("middleware", DEFAULT)
    kind, is_hardware = MIDDLEWARES.get(middleware), given.get("system") == "HW"
    is_layer = kind is not None and kind.layer == "RT"
    usual = {"lockstep": "false", "factor": "1", "rates": ""}
    changed = {name for name, value in usual.items() if given.get(name, value) != value}
    errors = [
        SolferError(f"{name} with {other}", where=launch, expected=f"{name} with {wanted} alone")
        for is_refused, other, wanted in (
            (is_layer, f"middleware:={middleware}", f"middleware:={DEFAULT}"),
            (is_hardware, "system:=HW", "system:=SM"),
        )
        if is_refused
        for name in sorted(changed)
    ]
    if given.get("namespace") and given.get("lockstep", "false").lower() == "true":
        wanted = "lockstep with a master of its own, which has one time"
        errors.append(SolferError("lockstep with a namespace", where=launch, expected=wanted))
    if is_hardware and given.get("world", "flat") != "flat":
        errors.append(SolferError("world with system:=HW", where=launch, expected="world with system:=SM alone"))
    return errors

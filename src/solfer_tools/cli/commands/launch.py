"""Check the arguments of a launch file.

roslaunch ignores arguments that it does not know, and takes any value. Launch files start this command, which looks at
the command line of the roslaunch that runs it, too. Without mistakes it prints the name of the file.
"""

import argparse
import os
import re
import shutil
from collections.abc import Callable, Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

from solfer.cli.options import Number, rate_number
from solfer.errors import ConfigError, MissingDependency, SolferError, UnknownName, raise_all, singles
from solfer.installation import pip_install

SWITCHES = ("control", "gui", "lockstep", "rviz", "view")
"""Arguments that are read without regard to case, as roslaunch does."""

RVIZ = "rviz.launch"
"""The launch file that starts RViz, which others include."""

FILE_ARGUMENTS = {
    "config": "a configuration",
    "mock": "the file of a mock",
    "file": "the file of a real-time layer",
    "urdf": "a URDF",
    "srdf": "an SRDF",
}
"""Arguments that are files, and which."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("file", metavar="FILE", type=Path, help="the launch file")
    parser.add_argument("arguments", metavar="NAME:=VALUE", nargs="*", help="arguments beside those of roslaunch")


def run(options: argparse.Namespace) -> int:
    """Print the name of the file, if all arguments are right.

    Raises:
        ConfigError: The launch file cannot be read.
        SolferErrors: Some arguments are not right.
        MissingDependency: It is a file that starts RViz or the page in the browser, which is not there.
    """
    if options.file.name == RVIZ and shutil.which("rviz") is None:
        raise MissingDependency(
            "there is no program 'rviz'",
            where=RVIZ,
            expected="RViz, in Debian the package `rviz` (apt-get install rviz), or rviz:=false",
        )
    page = "view.launch"
    if options.file.name == page and find_spec("viser") is None:
        raise MissingDependency(
            "there is no module 'viser'",
            where=page,
            expected=f"{pip_install('viser', file='requirements-view.txt')}, or view:=false",
        )
    given = dict(split(options.arguments)) | dict(split(started(os.getppid(), options.file)))
    known = known_to(options.file)
    if given:
        raise_all(check(known, given, options.file.name))
    print(options.file.name)
    return 0


def known_to(file: Path) -> dict[str, str]:
    """Return the arguments that a launch file takes, with their defaults; empty: there is none.

    Raises:
        ConfigError: It cannot be read.
    """
    try:
        arguments = ElementTree.parse(file).getroot().findall("arg")
    except (OSError, ElementTree.ParseError) as error:
        raise ConfigError(
            f"the launch file cannot be read: {error}", where=str(file), expected="a launch file of roslaunch"
        ) from None
    return {each.get("name", ""): each.get("default", "") for each in arguments if each.get("value") is None}


def split(arguments: Iterable[str]) -> list[tuple[str, str]]:
    """Return names and values of those that are `name:=value`; names of ROS, with underscores, are left out."""
    parts = (each.partition(":=") for each in arguments)
    return [(name, value) for name, sign, value in parts if sign and not name.startswith("_")]


def started(process: int, file: Path) -> list[str]:
    """Return the command line of a process, behind the launch file; empty if it does not run that file itself."""
    try:
        words = Path(f"/proc/{process}/cmdline").read_text(errors="replace").split("\0")
    except OSError:
        return []
    places = [index for index, word in enumerate(words) if Path(word).name == file.name]
    return words[places[0] :] if places and _is_meant(words[places[0] - 1], words[places[0]], file) else []


def _is_meant(package: str, word: str, file: Path) -> bool:
    """Return whether a word of a command line, behind another one, names a launch file: another may have its name."""
    if Path(word).is_file():
        return os.path.samefile(word, file)
    manifest = file.parents[1] / "package.xml"
    return manifest.is_file() and ElementTree.parse(manifest).findtext("name") == package


def choices(known: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Return the arguments with few values."""
    # imported here: the command starts before anything else does
    from solfer.config.records.middlewares import MIDDLEWARES
    from solfer.simulation.world.records import ENGINES

    return {
        "engine": ENGINES,
        "middleware": tuple(name for name, kind in MIDDLEWARES.items() if not kind.block),  # roslaunch starts no ROS 2
        "system": ("SM", "HW"),
        "layer": ("NRT", "RT"),
        "motion": ("tasks", "joints"),
        # in simulation.launch `lockstep` is a list of nodes
        **{name: ("true", "false") for name in SWITCHES if known.get(name) != ""},
    }


def numbers() -> dict[str, Number]:
    """Return the arguments that are numbers."""
    return {
        "rate": rate_number(),
        "factor": Number(0.01, 1000.0, "simulated seconds for each second", zero=True),
    }


def check(known: Mapping[str, str], given: Mapping[str, str], launch: str) -> list[SolferError]:
    """Find what is wrong with arguments, by themselves and together.

    Args:
        known: Arguments of the launch file, with their defaults.
        given: Arguments that were given, with their values.
        launch: Name of the launch file.
    """
    errors: list[SolferError] = []
    values = choices(known)
    bounds = numbers()
    for name, value in given.items():
        where = f"{launch}, {name}:={value}"
        if name not in known:
            errors.append(UnknownName("argument", name, known, where=launch))
        elif name in values and (value or known[name]):
            lower = value.lower() if name in SWITCHES else value
            if lower not in values[name]:
                errors.append(UnknownName(f"value of {name}", value, values[name], where=where))
        elif name in bounds and value:
            try:
                bounds[name](value)
            except argparse.ArgumentTypeError as error:
                what, _, expected = str(error).partition(", expected ")
                errors.append(SolferError(f"{name} is {what}", where=where, expected=expected))
        elif name in FILE_ARGUMENTS and not Path(value).is_file():
            errors.append(
                SolferError(f"there is no file '{value}'", where=f"{launch}, {name}", expected=FILE_ARGUMENTS[name])
            )
        elif name == "namespace" and not known[name] and value and not re.fullmatch(r"[A-Za-z]\w*", value, re.ASCII):
            expected = "a letter, then letters, digits and underscores"
            errors.append(SolferError(f"'{value}' is no namespace", where=f"{launch}, namespace", expected=expected))
    used = {name: value for name, value in given.items() if name in known and value}
    return errors + _of_the_robot(used, launch) + _together(used, launch)


def _of_the_robot(given: Mapping[str, str], launch: str) -> list[SolferError]:
    """Find what is wrong with the robot, its state, the world, the rates and the place of a recording."""
    from solfer.model.srdf.semantics import Semantics
    from solfer.model.urdf.description import Description
    from solfer.robot.description.shipped import robot_named, robot_of
    from solfer.simulation.sensors import Rates
    from solfer.simulation.server.rates import changed_rates
    from solfer.simulation.world.world import find_world, read_world

    def check_robot() -> None:
        name = given.get("robot", "centauro")  # the default of the launch files
        files = robot_of(name)[1] if launch == RVIZ else robot_named(name)
        if "state" in given and files.srdf is not None:
            states = Semantics.from_file(files.srdf, Description.from_file(files.urdf)).states
            if given["state"] not in states:
                raise UnknownName("state", given["state"], states, where=f"{launch}, state")

    checks: dict[str, Callable[[], object]] = {
        "robot": check_robot,
        "state": check_robot,
        "world": lambda: read_world(find_world(given["world"])),
        "rates": lambda: changed_rates(Rates(), given["rates"]),
    }
    errors: list[SolferError] = []
    for one in dict.fromkeys(checks[name] for name in given if name in checks):
        try:
            one()
        except SolferError as error:
            errors += singles([error])
    if (file := given.get("record", "")) and not Path(file).absolute().parent.is_dir():
        what = f"there is no folder '{Path(file).parent}'"
        errors.append(SolferError(what, where=f"{launch}, record", expected="a file in a folder that is there"))
    return errors


def _together(given: Mapping[str, str], launch: str) -> list[SolferError]:
    """Find arguments that exclude each other."""
    from solfer.config.records.middlewares import DEFAULT_MIDDLEWARE, MIDDLEWARES

    middleware = given.get("middleware", DEFAULT_MIDDLEWARE)
    kind = MIDDLEWARES.get(middleware)
    is_hardware = given.get("system") == "HW"
    is_layer = kind is not None and kind.layer == "RT"
    usual = {"lockstep": "false", "factor": "1", "rates": ""}
    changed = {name for name, value in usual.items() if given.get(name, value) != value}
    errors = [
        SolferError(f"{name} with {other}", where=launch, expected=f"{name} with {needed} alone")
        for is_refused, other, needed in (
            (is_layer, f"middleware:={middleware}", f"middleware:={DEFAULT_MIDDLEWARE}"),
            (is_hardware, "system:=HW", "system:=SM"),
        )
        if is_refused
        for name in sorted(changed)
    ]
    if "namespace" in given and given.get("lockstep", "false").lower() == "true":
        expected = "lockstep with a master of its own, which has one time"
        errors.append(SolferError("lockstep with a namespace", where=launch, expected=expected))
    if is_hardware and given.get("world", "flat") != "flat":
        errors.append(SolferError("world with system:=HW", where=launch, expected="world with system:=SM alone"))
    return errors

"""Options that several sub-commands share."""

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any


class Number:
    """A number of a command line, for `type=` of an argument.

    Args:
        low: Smallest value.
        high: Largest value.
        unit: Unit, for messages; empty: it has none.
        kind: `float`, or `int` for a whole number.
        zero: Whether zero is allowed, too.
    """

    def __init__(self, low: float, high: float, unit: str, kind: type = float, zero: bool = False):
        self._low = low
        self._high = high
        self._kind = kind
        self._zero = zero
        what = f"{'0, or ' if zero else ''}{'a whole number' if kind is int else 'a number'}"
        self.expected = f"{what} from {low:g} to {high:g}{unit and f' [{unit}]'}"

    def __call__(self, text: str) -> float:
        """Parse a number.

        Raises:
            ArgumentTypeError: The text is not such a number, or it is out of bounds.
        """
        try:
            value = self._kind(text)
        except ValueError:
            value = None
        if value == 0.0 and self._zero:
            return value
        if value is None or not self._low <= value <= self._high:
            raise argparse.ArgumentTypeError(f"'{text}', expected {self.expected}")
        return value


def add_file(parser: argparse.ArgumentParser, **more: Any) -> None:
    """Add FILE, the main configuration."""
    parser.add_argument("file", metavar="FILE", help="main configuration", **more)


def add_search_paths(parser: argparse.ArgumentParser) -> None:
    """Add --search-path, for a configuration that was written on another machine."""
    parser.add_argument(
        "--search-path",
        dest="search_paths",
        metavar="DIR",
        action="append",
        default=[],
        help="folder to search for files that are not where the configuration expects them, by "
        "the longest tail of their paths; repeat it for several",
    )


def add_system(parser: argparse.ArgumentParser) -> None:
    """Add --system, which replaces the `system` of the file."""
    parser.add_argument("--system", choices=("SM", "HW"), help="instead of the file's `system`")


def add_column(parser: argparse.ArgumentParser) -> None:
    """Add --column, for a picture in a paper."""
    parser.add_argument("--column", action="store_true", help="draw for a paper's column: 3.5 inch wide, 8 pt")


def add_namespace(
    parser: argparse.ArgumentParser, actions: Iterable[argparse.ArgumentParser], default: str, meaning: str
) -> None:
    """Add --namespace before and after each action of a sub-command; an action prints its own usage after a mistake."""
    parser.add_argument("--namespace", default=default, metavar="NAME", help=meaning)
    for action in actions:
        action.add_argument("--namespace", default=argparse.SUPPRESS, metavar="NAME", help=meaning)
        action.set_defaults(parser=action)


def rate_number() -> Number:
    """Return the type of an argument that is a rate of plugins [Hz]."""
    # imported here: commands that need no configuration start without it
    from solfer.config.records.bounds import RATE

    return Number(RATE["ge"], RATE["le"], "Hz")


def add_rate(parser: argparse.ArgumentParser) -> None:
    """Add --rate [Hz], which replaces that of the file; empty: as in the file."""
    rate = rate_number()
    parser.add_argument(
        "--rate",
        type=lambda text: rate(text) if text else None,
        metavar="HZ",
        help="control cycles a second, instead of the file's",
    )


def add_robot_files(parser: argparse.ArgumentParser, source: bool = False) -> None:
    """Add --urdf and --srdf, for a robot that is not shipped; with `source` also --from, one of which is needed."""
    where = parser.add_mutually_exclusive_group(required=True) if source else parser
    where.add_argument("--urdf", type=Path, metavar="FILE", help="the robot's URDF")
    if source:
        where.add_argument(
            "--from",
            dest="source",
            metavar="SOURCE",
            help="a robot as MJCF (FILE.xml), or COLLECTION:NAME of example-robot-data, pybullet_data, "
            "robot_descriptions or menagerie",
        )
    parser.add_argument("--srdf", type=Path, metavar="FILE", help="the robot's SRDF")


SECONDS = Number(0.01, 86400.0, "seconds")


def add_times(parser: argparse.ArgumentParser) -> None:
    """Declare when tables are printed."""
    parser.add_argument("--once", action="store_true", help="print the table once instead of again and again")
    parser.add_argument("--json", action="store_true", help="print the health as a line of JSON")
    parser.add_argument(
        "--every", type=SECONDS, default=1.0, metavar="SECONDS", help="time between two tables (default: 1)"
    )

"""The form that the benchmarks of this folder share: `--help`, `--json`, and rows of figures."""

import argparse
import json
import os
from collections.abc import Sequence
from typing import Any

from solfer.simulation.engines import ENGINE_VARIABLE
from solfer.simulation.world.records import ENGINES

WIDTH, TITLE = 11, 52
"""Least width of a figure, and that of the title of a row."""


def parser_of(documentation: str | None) -> argparse.ArgumentParser:
    """Return a parser with the text of a benchmark, and `--json`."""
    first, _, rest = (documentation or "").partition("\n")
    parser = argparse.ArgumentParser(
        description=f"{first}\n{rest}", formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", action="store_true", help="print one object a line")
    return parser


class _ChosenEngine(argparse.Action):
    """Chooses the physics engine of this process, and of those that it starts."""

    def __call__(self, parser: Any, namespace: Any, values: str | Sequence[Any] | None, option: Any = None) -> None:
        os.environ[ENGINE_VARIABLE] = str(values)


def add_engine(parser: argparse.ArgumentParser) -> None:
    """Add `--engine`, for all simulations whose world names none."""
    parser.add_argument("--engine", choices=ENGINES, action=_ChosenEngine, help="physics engine")


class Figures:
    """Prints rows of figures, as a table or as one JSON object a line.

    Args:
        is_json: Whether they are JSON.
    """

    def __init__(self, is_json: bool):
        self._is_json = is_json
        self._head: tuple[str, ...] = ()

    def row(self, title: str, **figures: float | str | None) -> None:
        """Print a row; a head where its figures have other names than those of the row before."""
        if self._is_json:
            print(json.dumps({"name": title, **figures}), flush=True)
            return
        if tuple(figures) != self._head:
            self._head = tuple(figures)
            print(f"{'':{TITLE}}" + "".join(f"{name:>{_width(name)}}" for name in figures))
        cells = (f"{_text(each):>{_width(name)}}" for name, each in figures.items())
        print(f"{title:{TITLE}}" + "".join(cells), flush=True)


def _width(name: str) -> int:
    return max(WIDTH, len(name) + 1)


def _text(value: Any) -> str:
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    return f"{value:.0f}" if abs(value) >= 10_000.0 else f"{value:.4g}"

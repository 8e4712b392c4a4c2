"""Reads tables of references: CSV files of times and numbers."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from solfer.config.records.bounds import COORDINATE
from solfer.config.yaml.files import read_text
from solfer.errors import ConfigError, SizeMismatch
from solfer.numerics.rotations import is_unit
from solfer.references.header import TIME_COLUMN, Field, TableHeader, fields_of, is_header, names_of, read_header

MAX_ROWS = 20_000
"""Largest number of rows of a table."""

Line = tuple[int, list[Field]]
"""The number of a line, and its fields."""


def read_table(
    path: Path, columns: Sequence[str], where: str, is_partial: bool
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Read a CSV file: times, and the numbers of a reference; empty lines do not count.

    A first line without numbers, or a comment before the first row, names the columns, see `read_header`. Without it
    they are the time [s], then `columns`.

    Args:
        path: The file.
        columns: Names of the numbers.
        where: Place that named the file.
        is_partial: Whether the columns are joints, of which some suffice.

    Returns:
        Times, shape (k,) [s], numbers in SI units, shape (k, n), and the names of their columns.

    Raises:
        ConfigError: The file cannot be read, a number is none, or times do not increase. SizeMismatch: A line has too
            few or too many numbers. UnknownName: There is no such column.
    """
    names, lines = _parts(path, columns, where)
    header = TableHeader.plain(columns)
    if names is not None:
        header = read_header(f"{path}:{names[0]}", names[1], columns, is_partial=is_partial)
    rows: list[list[float]] = []
    begin = header.names.index(TIME_COLUMN)
    turn = [header.names.index(name) for name in ("qx", "qy", "qz", "qw") if name in header.names]
    for line, fields in lines:
        if len(fields) != len(header.names):
            raise SizeMismatch(
                f"{len(fields)} numbers",
                where=f"{path}:{line}:1",
                expected=f"{len(header.names)}: {', '.join(header.names)}",
            )
        row = [
            _number(f"{path}:{line}", *each, is_time=index == begin)
            for index, each in enumerate(zip(fields, header.factors, strict=True))
        ]
        time = row[begin]
        if time < 0.0 or (rows and time <= rows[-1][begin]):
            after = f" after one of {rows[-1][begin]:g} s" if rows else ""
            raise ConfigError(
                f"a time of {time:g} s{after}",
                where=f"{path}:{line}:{fields[begin].column}",
                expected="times that increase, from 0 s on",
            )
        if turn:
            require_length([row[index] for index in turn], f"{path}:{line}:{fields[min(turn)].column}")
        rows.append(row)
        if len(rows) > MAX_ROWS:
            raise ConfigError("too many lines", where=f"{path}:{line}:1", expected=f"{MAX_ROWS} at most")
    if not rows or (len(rows) == 1 and rows[0][begin] == 0.0):
        raise ConfigError(
            f"'{path}' has no motion", where=f"{path}:1:1", expected="a line of numbers after 0 s, or several"
        )
    numbers = np.array(rows)
    return numbers[:, begin], np.delete(numbers, begin, axis=1), [name for name in header.names if name != TIME_COLUMN]


def joints_in(path: Path, where: str) -> list[str]:
    """Return the names of the columns beside the time, as the first line of a CSV file has them; empty: it has none.

    Raises:
        ConfigError: The file cannot be read; `where` is the place that named it.
    """
    names, _ = _parts(path, (), where)
    return [] if names is None else names_of(names[1])


def require_length(quaternion: Sequence[float], where: str) -> None:
    """Check that a quaternion has the length 1; a ConfigError at `where` if not."""
    if not is_unit(quaternion):
        raise ConfigError(f"the quaternion {list(quaternion)}", where=where, expected="a quaternion of length 1")


def _parts(path: Path, columns: Sequence[str], where: str) -> tuple[Line | None, list[Line]]:
    """Return the line that names the columns, None: there is none, and those of numbers.

    Raises:
        ConfigError: The file cannot be read; `where` is the place that named it.
    """
    names = comment = None
    lines: list[Line] = []
    for line, text in enumerate(read_text(str(path), where).split("\n"), 1):
        fields = fields_of(text) if text.strip() else []
        if text.lstrip().startswith("#"):
            if not lines and is_header(fields, columns):
                comment = (line, fields)
        elif names is None and not lines and fields and not any(_is_number(field.text) for field in fields):
            names = (line, fields)
        elif fields:
            lines.append((line, fields))
            if len(lines) > MAX_ROWS:
                break
    if names is None and comment is not None and lines and len(comment[1]) == len(lines[0][1]):
        names = comment
    return names, lines


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def _number(place: str, field: Field, factor: float, is_time: bool) -> float:
    value = float(field.text) * factor if _is_number(field.text) else math.nan
    most = 1e5 if is_time else COORDINATE["le"]
    if not abs(value) <= most:
        raise ConfigError(
            f"'{field.text}'", where=f"{place}:{field.column}", expected=f"a number up to {most / factor:g}"
        )
    return value

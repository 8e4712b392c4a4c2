"""Reads tables of references: CSV files of times and numbers."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from solfer.config.records.bounds import COORDINATE
from solfer.config.yaml.files import read_text
from solfer.errors import ConfigError, SizeMismatch, UnknownName

TABLE_ROWS = 20_000
"""Rows of a table."""

UNIT_TOLERANCE = 1e-3
"""Largest deviation of a quaternion's length from one."""


def read_table(path: Path, columns: Sequence[str], where: str, named: bool) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Read a CSV file: a time [s], then the numbers of a reference; empty lines and those with `#` do not count.

    A first line without numbers names the columns.

    Args:
        path: The file.
        columns: Names of the numbers.
        where: Place that named the file.
        named: Whether its first line may name some of the columns, in any order; else it says nothing.

    Returns:
        Times, shape (k,), numbers, shape (k, n), and the names of their columns.

    Raises:
        ConfigError: The file cannot be read, a number is none, or times do not increase.
        SizeMismatch: A line has too few or too many numbers.
        UnknownName: There is no such column.
    """
    found = list(columns)
    is_first = True
    rows: list[list[float]] = []
    for line, text in enumerate(read_text(str(path), where).splitlines(), 1):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        fields = text.split(",")
        is_header = is_first and not any(map(_is_number, fields))
        is_first = False
        if is_header:
            if named:
                found = _header(f"{path}:{line}", fields, columns)
            continue
        if len(fields) != 1 + len(found):
            raise SizeMismatch(
                f"{len(fields)} numbers",
                where=f"{path}:{line}:1",
                expected=f"{1 + len(found)}: time, {', '.join(found)}",
            )
        row = [_number(f"{path}:{line}", fields, index) for index in range(len(fields))]
        if row[0] < 0.0 or (rows and row[0] <= rows[-1][0]):
            after = f" after one of {rows[-1][0]:g} s" if rows else ""
            raise ConfigError(
                f"a time of {row[0]:g} s{after}", where=f"{path}:{line}:1", expected="times that increase, from 0 s on"
            )
        if "qw" in found:
            require_length(row[-4:], f"{path}:{line}:{_column(fields, len(fields) - 4)}")
        rows.append(row)
        if len(rows) > TABLE_ROWS:
            raise ConfigError("too many lines", where=f"{path}:{line}:1", expected=f"{TABLE_ROWS} at most")
    if not rows or (len(rows) == 1 and rows[0][0] == 0.0):
        raise ConfigError(
            f"'{path}' has no motion", where=f"{path}:1:1", expected="a line of numbers after 0 s, or several"
        )
    numbers = np.array(rows)
    return numbers[:, 0], numbers[:, 1:], found


def header_of(path: Path, where: str) -> list[str]:
    """Return the names of the columns behind the time, as the first line of a CSV file has them; empty: it has none.

    Raises:
        ConfigError: The file cannot be read; `where` is the place that named it.
    """
    for text in read_text(str(path), where).splitlines():
        if text.strip() and not text.lstrip().startswith("#"):
            fields = text.split(",")
            return [] if any(map(_is_number, fields)) else [field.strip() for field in fields[1:]]
    return []


def require_length(quaternion: Sequence[float], where: str) -> None:
    """Check that a quaternion has the length 1; a ConfigError at `where` if not."""
    if abs(math.hypot(*quaternion) - 1.0) > UNIT_TOLERANCE:
        raise ConfigError(f"the quaternion {list(quaternion)}", where=where, expected="a quaternion of length 1")


def _header(place: str, fields: Sequence[str], columns: Sequence[str]) -> list[str]:
    names = [field.strip() for field in fields][1:]
    for index, name in enumerate(names, 1):
        where = f"{place}:{_column(fields, index)}"
        if name not in columns:
            raise UnknownName("joint", name, columns, where=where)
        if name in names[: index - 1]:
            raise ConfigError(f"joint '{name}' is there twice", where=where, expected="each joint once")
    if not names:
        raise ConfigError("there is one column", where=f"{place}:1", expected="the time, then the joints")
    return names


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def _number(place: str, fields: Sequence[str], index: int) -> float:
    value = float(fields[index]) if _is_number(fields[index]) else math.nan
    if not abs(value) <= COORDINATE["le"] and not (index == 0 and 0.0 <= value <= 1e5):
        raise ConfigError(
            f"'{fields[index].strip()}'",
            where=f"{place}:{_column(fields, index)}",
            expected=f"a number up to {COORDINATE['le']:g}",
        )
    return value


def _column(fields: Sequence[str], index: int) -> int:
    """Return the column at which a field begins, from 1 on."""
    before = sum(len(field) + 1 for field in fields[:index])
    return before + len(fields[index]) - len(fields[index].lstrip()) + 1

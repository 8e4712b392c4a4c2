"""The first line of a table: which column has which number, and in which unit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from solfer.errors import ConfigError, UnknownName

TIME_COLUMN = "time"
"""Name of the column of times."""


@dataclass(frozen=True)
class Field:
    """A field of a line.

    Attributes:
        text: What stands there.
        column: Where it begins, from 1 on.
    """

    text: str
    column: int


@dataclass(frozen=True)
class TableHeader:
    """What the columns of a table are.

    Attributes:
        names: Name of each column; one is `TIME_COLUMN`.
        factors: What makes SI units of the numbers of each column.
    """

    names: tuple[str, ...]
    factors: tuple[float, ...]

    @classmethod
    def plain(cls, columns: Sequence[str]) -> "TableHeader":
        """Return that of a table without names: the time, then the columns."""
        return cls((TIME_COLUMN, *columns), (1.0,) * (1 + len(columns)))


def fields_of(text: str) -> list[Field]:
    """Split a line at its commas, or at blanks if it has none; `#` at its begin does not count."""
    text = re.sub(r"^(\s*)#", r"\1 ", text)
    if "," not in text:
        # a name, and perhaps its unit in brackets behind a blank
        fields = re.finditer(r"\S+?(?:\s*[\[(][^\])]*[\])])?(?=\s|$)", text)
        return [Field(each.group(), each.start() + 1) for each in fields]
    places = [each.span(1) for each in re.finditer(r"(?:^|,)\s*([^,]*)", text)]
    return [Field(text[begin:end].strip().strip('"'), begin + 1) for begin, end in places]


def read_header(place: str, fields: Sequence[Field], columns: Sequence[str], is_partial: bool) -> TableHeader:
    """Read names and units of columns, in any order.

    Names are those of `columns`, such as `x` and `qw`, or those of TUM (`tx`), EuRoC (`p_RS_R_x`, `q_RS_w`) and ROS
    (`position.x`, `orientation.w`).

    Args:
        place: File and line.
        fields: The fields of the line.
        columns: Names of the numbers behind the time.
        is_partial: Whether the columns are joints, of which some suffice.

    Raises:
        UnknownName: There is no such column.
        ConfigError: A column is there twice or missing, or has another unit.
    """
    kind = "joint" if is_partial else "column"
    names: list[str] = []
    factors: list[float] = []
    for field in fields:
        where = f"{place}:{field.column}"
        name, unit = _resolved(field, columns)
        if name not in (TIME_COLUMN, *columns):
            known = list(columns) if is_partial and TIME_COLUMN in names else [TIME_COLUMN, *columns]
            raise UnknownName(kind, name, known, where=where, expected=", ".join((TIME_COLUMN, *columns)))
        if name in names:
            raise ConfigError(f"{kind} '{name}' is there twice", where=where, expected=f"each {kind} once")
        units = _units(name)
        if unit and unit not in units:
            raise ConfigError(f"'{name}' in '{unit}'", where=where, expected=f"one of {', '.join(units)}")
        names.append(name)
        factors.append(units.get(unit, 1.0))
    missing = [name for name in (TIME_COLUMN, *columns) if name not in names]
    if TIME_COLUMN in missing or (missing and not is_partial):
        raise ConfigError(
            f"there is no column '{missing[0]}'", where=f"{place}:1", expected=", ".join((TIME_COLUMN, *columns))
        )
    if len(names) == 1:
        raise ConfigError("there is one column", where=f"{place}:1", expected=f"the {TIME_COLUMN}, then the {kind}s")
    return TableHeader(tuple(names), tuple(factors))


def is_header(fields: Sequence[Field], columns: Sequence[str]) -> bool:
    """Return whether a comment names columns: a time, and one at least that is known."""
    found = [_resolved(field, columns)[0] for field in fields]
    return found[:1] == [TIME_COLUMN] and any(name in columns for name in found)


def names_of(fields: Sequence[Field]) -> list[str]:
    """Return the names of a line, without units and without the time, whichever the columns are."""
    found = [_resolved(field, ()) for field in fields]
    return [name for name, _ in found if name != TIME_COLUMN]


def _resolved(field: Field, columns: Sequence[str]) -> tuple[str, str]:
    """Return the name of a column as solfer writes it, or as it is if it is unknown, and its unit; empty: none."""
    if field.text in columns:
        return field.text, ""
    split = re.fullmatch(r"(.*?)\s*(?:\[(.*)\]|\((.*)\))", field.text)
    text = split[1] if split else field.text
    unit = (split[2] or split[3] or "").strip() if split else ""
    if text in columns:
        return text, unit
    time_names = r"(?:header[._])?(?:t|time|timestamp|time_?stamp|stamp|secs?|seconds)"
    position_names = r"(?:t_?|p_?|p_\w+_|(?:pose[._])?(?:pos|position|translation)[._])?([xyz])"
    quaternion_names = r"(?:q_?|q_\w+_|(?:pose[._])?(?:quat|quaternion|orientation|rotation)[._])([xyzw])"
    if re.fullmatch(time_names, text, re.IGNORECASE):
        return TIME_COLUMN, unit
    position = re.fullmatch(position_names, text, re.IGNORECASE)
    quaternion = re.fullmatch(quaternion_names, text, re.IGNORECASE)
    if quaternion is None and "x" not in columns:
        quaternion = re.fullmatch("([xyzw])", text)
    for match, prefix in ((position, ""), (quaternion, "q")):
        if match and prefix + match[1].lower() in columns:
            return prefix + match[1].lower(), unit
    return text, unit


def _units(name: str) -> dict[str, float]:
    """Return the units in which a column may be, and their values in SI."""
    if name == TIME_COLUMN:
        return {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
    lengths = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
    if name in ("x", "y", "z"):
        return lengths
    if name in ("qx", "qy", "qz", "qw"):
        return {"1": 1.0, "-": 1.0}
    return {"rad": 1.0, "deg": 0.017453292519943295} | lengths

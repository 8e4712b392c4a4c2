"""What is measured of a run: columns that are sampled, reduced, and combined."""

import math
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from simpleeval import InvalidExpression, SimpleEval

from solfer.errors import ConfigError, UnknownName
from solfer.recording.log import LogSource
from solfer_tools.study.records import MeasureRecord, StudyRecord

REDUCTIONS: dict[str, Callable[[np.ndarray], float]] = {
    "rms": lambda rows: math.sqrt(float(np.mean(rows**2))),
    "max": lambda rows: float(rows.max()),
    "min": lambda rows: float(rows.min()),
    "mean": lambda rows: float(rows.mean()),
    "std": lambda rows: float(rows.std()),
    "begin": lambda rows: float(rows[0]),
    "end": lambda rows: float(rows[-1]),
    "change": lambda rows: float(rows[-1] - rows[0]),
}


class Columns:
    """Numbers of live arrays over time, of which those that are measured are kept.

    Args:
        sources: The arrays.
        names: Columns that are kept, `CHANNEL/COLUMN`.
        where: Place of a name, for errors.

    Raises:
        UnknownName: There is no such column.
        ConfigError: Its numbers differ from machine to machine.
    """

    def __init__(self, sources: Sequence[LogSource], names: Iterable[str], where: Callable[[str], str]):
        places = {
            f"{source.channel.name}/{column}": (source, place)
            for source in sources
            for place, column in enumerate(source.channel.columns)
        }
        self._order = {name: index for index, name in enumerate(dict.fromkeys(names))}
        self._cells: list[tuple[np.ndarray, int, float]] = []
        for name in self._order:
            if name not in places:
                raise UnknownName("column", name, places, where=where(name))
            if name.split("/")[1] in ("timing", "load"):  # a run that is repeated would have other numbers
                raise ConfigError(
                    f"'{name}' differs from machine to machine", where=where(name), expected="a column of the robot"
                )
            source, place = places[name]
            factor = source.factor if source.array.dtype == np.int64 else 1.0
            self._cells.append((source.array.reshape(-1), place, factor))
        self.names = tuple(self._order)
        self._rows = np.zeros((1024, len(self._cells)))
        self._times = np.zeros(len(self._rows))
        self.count = 0

    def sample(self, time: float) -> None:
        """Keep the numbers of a time [s]."""
        if self.count == len(self._times):
            self._rows = np.concatenate((self._rows, np.zeros_like(self._rows)))
            self._times = np.concatenate((self._times, np.zeros_like(self._times)))
        row = self._rows[self.count]
        for index, (array, place, factor) in enumerate(self._cells):
            row[index] = factor * array[place]
        self._times[self.count] = time
        self.count += 1

    def clear(self) -> None:
        """Forget all rows."""
        self.count = 0

    @property
    def times(self) -> np.ndarray:
        """Times of the rows, shape (n,) [s]."""
        return self._times[: self.count]

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the numbers of a column that is kept, shape (n,)."""
        return self._rows[: self.count, self._order[name]]


def reduced(record: MeasureRecord, columns: Columns) -> float:
    """Return the number that a measure makes of columns; NaN without any row."""
    until = math.inf if record.until is None else record.until
    counts = (columns.times >= record.since) & (columns.times <= until)
    if not counts.any():
        return math.nan
    names, subtracted = record.names()
    rows = np.array([columns[name][counts] for name in names])
    if subtracted:
        rows -= np.array([columns[name][counts] for name in subtracted])
    values = rows[0] if len(rows) == 1 else np.sqrt((rows**2).sum(axis=0))
    return REDUCTIONS[record.reduce](np.abs(values) if record.absolute else values)


def evaluated(expression: str, values: Mapping[str, Any], where: str) -> Any:
    """Return the value of an expression of numbers by name; NaN where it is not defined.

    Raises:
        ConfigError: It is no expression, or names something else.
    """
    functions: Sequence[Callable[..., Any]] = (abs, min, max, math.sqrt, math.hypot, math.log, math.exp, math.isfinite)
    by_name = {each.__name__: each for each in functions}
    evaluator = SimpleEval(functions=by_name, names={"pi": math.pi, "inf": math.inf, **values})
    try:
        return evaluator.eval(expression)
    except (ZeroDivisionError, OverflowError, ValueError):
        return math.nan
    except (InvalidExpression, SyntaxError, TypeError, KeyError, AttributeError, RecursionError, MemoryError) as error:
        raise ConfigError(
            f"'{textwrap.shorten(expression, 200)}' cannot be computed: {error}",
            where=where,
            expected="an expression of",
            names=tuple(values),
        ) from None


def measured(
    measures: Mapping[str, MeasureRecord], columns: Columns, variations: Mapping[str, Any]
) -> dict[str, float]:
    """Return all measures of a run; an expression may name those before it, and variations.

    Raises:
        ConfigError: An expression cannot be computed.
    """
    found: dict[str, Any] = {name: value for name, value in variations.items() if name.isidentifier()}
    results: dict[str, float] = {}
    for name, record in measures.items():
        if record.derive is None:
            value = reduced(record, columns)
        else:
            value = float(evaluated(record.derive, found, record.where("derive")))
        found[name] = results[name] = value
    return results


def check_expressions(record: StudyRecord, names: Iterable[str]) -> None:
    """Check, before the first run, that all expressions of a study can be computed, whose variations have these names.

    Raises:
        ConfigError: One cannot.
    """
    known: dict[str, Any] = {name: 1.0 for name in names if name.isidentifier()}
    for name, measure in record.measure.items():
        if measure.derive is not None:
            evaluated(measure.derive, known, measure.where("derive"))
        known[name] = 1.0
    for name, expression in record.fails.items():
        evaluated(expression, known, record.where("fails", name))

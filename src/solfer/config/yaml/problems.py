"""Mistakes of a configuration, collected so that all are reported at once, and warnings beside them."""

import logging
from collections.abc import Iterable
from typing import NamedTuple

from solfer.config.yaml.nodes import Mark
from solfer.errors import ConfigError, SolferError, UnknownName, raise_all


class Notice(NamedTuple):
    """A warning, or an information: worth knowing although the configuration can be used.

    Attributes:
        mark: Place.
        what: The warning in one sentence, without a full stop.
        severity: 'warning' or 'info'.
    """

    mark: Mark
    what: str
    severity: str = "warning"

    def __str__(self) -> str:
        return f"{self.mark}: {self.what}"


class Problems:
    """Errors and warnings with their places, file by file and from top to bottom.

    Args:
        complete: Whether missing parts are errors; else they are warnings, for what no module uses.
    """

    def __init__(self, complete: bool = True) -> None:
        self._found: list[tuple[Mark, SolferError]] = []
        self._notices: list[Notice] = []
        self._files: list[str] = []
        self._complete = complete

    def reading(self, file: str) -> None:
        """Note that `file` is read now; its mistakes come after those of earlier files."""
        if file not in self._files:
            self._files.append(file)

    def __bool__(self) -> bool:
        return bool(self._found)

    @property
    def errors(self) -> tuple[SolferError, ...]:
        """The errors, ordered by file and line."""
        return tuple(error for _, error in sorted(self._found, key=lambda found: self._order(found[0])))

    @property
    def notices(self) -> tuple[Notice, ...]:
        """The warnings, ordered by file and line."""
        return tuple(sorted(self._notices, key=lambda notice: self._order(notice.mark)))

    def add(self, mark: Mark, what: str, expected: str = "", names: Iterable[str] = ()) -> None:
        """Note a ConfigError at `mark`."""
        self.put(mark, ConfigError(what, where=str(mark), expected=expected, names=tuple(names)))

    def missing(self, mark: Mark, what: str, expected: str = "") -> None:
        """Note that something is missing at `mark`: an error, or a warning in parts that no module uses."""
        if self._complete:
            self.add(mark, what, expected)
        else:
            self.warn(mark, f"{what}, so nothing can use it")

    def unknown(self, mark: Mark, kind: str, name: str, known: Iterable[str], expected: str = "") -> None:
        """Note an UnknownName at `mark`."""
        self.put(mark, UnknownName(kind, name, known, where=str(mark), expected=expected))

    def put(self, mark: Mark, error: SolferError) -> None:
        """Note `error`, which contains `mark` itself; an equal one that was noted before is left out."""
        self.reading(mark.file)
        if all(str(error) != str(other) for _, other in self._found):
            self._found.append((mark, error))

    def warn(self, mark: Mark, what: str, severity: str = "warning") -> None:
        """Note a warning at `mark`; an equal one that was noted before is left out."""
        self.reading(mark.file)
        notice = Notice(mark, what, severity)
        if notice not in self._notices:
            self._notices.append(notice)

    def inform(self, mark: Mark, what: str) -> None:
        """Note at `mark` what is no fault of the configuration."""
        self.warn(mark, what, "info")

    def absorb(self, other: "Problems", notices: bool = True) -> None:
        """Note all errors of `other`, and if `notices` its warnings, too."""
        for file in other._files:
            self.reading(file)
        for mark, error in other._found:
            self.put(mark, error)
        for notice in other._notices if notices else ():
            self.warn(*notice)

    def log(self, logger: logging.Logger) -> None:
        """Write the warnings to a log."""
        for notice in self.notices:
            logger.log(logging.WARNING if notice.severity == "warning" else logging.INFO, "%s", notice)

    def raise_if_any(self) -> None:
        """Raise the errors: the single one itself, or all in one `SolferErrors`."""
        raise_all(self.errors)

    def _order(self, mark: Mark) -> tuple[int, int, int]:
        return self._files.index(mark.file), mark.line, mark.column

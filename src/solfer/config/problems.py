"""Mistakes of a configuration, collected so that all are reported at once."""

from collections.abc import Iterable

from solfer.config.nodes import Mark
from solfer.errors import ConfigError, SolferError, UnknownName, raise_all


class Problems:
    """Errors with their places; `raise_if_any` reports them file by file, from top to bottom."""

    def __init__(self) -> None:
        self._found: list[tuple[Mark, SolferError]] = []
        self._files: list[str] = []

    def reading(self, file: str) -> None:
        """Say that `file` is read now; its mistakes come behind those of the files before."""
        if file not in self._files:
            self._files.append(file)

    def __bool__(self) -> bool:
        return bool(self._found)

    def add(self, mark: Mark, what: str, expected: str = "", names: Iterable[str] = ()) -> None:
        """Note a ConfigError at `mark`."""
        self.put(mark, ConfigError(what, where=str(mark), expected=expected, names=tuple(names)))

    def unknown(self, mark: Mark, kind: str, name: str, known: Iterable[str], expected: str = "") -> None:
        """Note an UnknownName at `mark`."""
        self.put(mark, UnknownName(kind, name, known, where=str(mark), expected=expected))

    def put(self, mark: Mark, error: SolferError) -> None:
        """Note `error`, which says `mark` itself; an equal one that was noted before is left out."""
        self.reading(mark.file)
        if all(str(error) != str(other) for _, other in self._found):
            self._found.append((mark, error))

    def raise_if_any(self) -> None:
        """Raise what was noted: the single error itself, or all in one `SolferErrors`."""
        ordered = sorted(self._found, key=lambda item: (self._files.index(item[0].file), item[0].line, item[0].column))
        raise_all([error for _, error in ordered])

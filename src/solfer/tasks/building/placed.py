"""Errors at the places of records."""

from collections.abc import Iterator
from contextlib import contextmanager

from solfer.config import Record
from solfer.config.yaml.nodes import Key, Mark
from solfer.errors import SolferError, SolferErrors


class Faults:
    """Collects errors, so that all of a record are reported at once.

    Attributes:
        errors: The errors.
    """

    def __init__(self) -> None:
        self.errors: list[SolferError] = []

    @contextmanager
    def at(self, record: Record, *path: Key) -> Iterator[None]:
        """Collect an error of the block, at the place of the value at `path` below the record."""
        try:
            yield
        except SolferErrors as errors:
            self.errors += errors.errors
        except SolferError as error:
            if Mark.read(error.where) is None:  # not yet a place in a file
                error.where = record.where(*path) or error.where
            self.errors.append(error)

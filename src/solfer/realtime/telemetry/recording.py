"""Makes a file from the records of a loop (`recorder.py`)."""

import contextlib
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.memory.ring import Ring
from solfer.middleware.shared_memory.memory.segment import Segment
from solfer.realtime.telemetry.recorder import FILE, KIND, width_of

BATCH = 256
"""Most records that are written to a file at once."""


class Recording:
    """The reading end: the records since it was opened, and those that the memory still held then.

    Drained records go at once to a file without a name, which need not be removed: a recording may be longer than the
    machine's memory.

    Args:
        folder: The namespace's folder.
        spool: Folder in which the file without a name is.

    Attributes:
        columns: Shapes of the recorded sources by name.
        labels: Texts beside the numbers.
        count: Number of drained records.

    Raises:
        MiddlewareError: This namespace has no recording, or no file can be made in `spool`.
    """

    def __init__(self, folder: Path, spool: Path | None = None):
        try:
            self._segment = Segment.attach(folder / FILE, KIND)
        except MiddlewareError as error:
            raise MiddlewareError(
                f"there is no recording: {error.what}",
                where=str(folder / FILE),
                expected="an RT layer in this namespace, with `record` above 0",
            ) from error
        layout = json.loads(self._segment.layout)
        self.columns = {source: tuple(shape) for source, shape in layout["columns"].items()}
        self.labels, self.count, self._dropped, self._same = layout["labels"], 0, 0, layout["same"]
        width = width_of(self.columns)
        self._ring = Ring(self._segment.data, width, layout["count"])
        # records overwritten before this do not count as lost; the oldest one may just be overwritten
        self._ring.sequence = max(0, self._ring.newest - layout["count"] + 1)
        self._row = np.dtype([("cycle", np.int64), ("time", np.int64), ("values", float, (width,))])
        self._batch = np.zeros(BATCH, self._row)
        self._where = spool or Path(tempfile.gettempdir())
        try:
            self._spool = tempfile.TemporaryFile(dir=spool, buffering=0)
        except OSError as error:
            raise _cannot_write(error, self._where) from error

    @property
    def lost(self) -> int:
        """Number of records that were overwritten before they were drained, or did not fit on the disk."""
        return self._ring.lost + self._dropped

    @property
    def over(self) -> bool:
        """Whether the recording process has ended, in good order or not."""
        return not self._segment.owned()

    def skip(self) -> None:
        """Leave out the records in the memory: the recording begins now."""
        self._ring.skip()

    def drain(self) -> int:
        """Fetch new records; return their number.

        Raises:
            MiddlewareError: The disk is full: records that did not fit are lost, later ones may fit.
        """
        before, full = self.count, True
        while full:
            number = self._fetch()
            self._keep(number)
            full = number == BATCH
        return self.count - before

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the drained records: `time` on the recorder's clock [s], `cycle`, each source; records first."""
        rows = np.zeros(0, self._row)
        if self.count:
            rows = np.memmap(self._spool, self._row, "r", shape=(self.count,))
        views = _views(rows["values"], self.columns)
        same = {source: views[first] for source, first in self._same.items()}
        return {"time": 1e-9 * rows["time"], "cycle": rows["cycle"]} | views | same

    def save(self, path: str | Path) -> None:
        """Write the drained records to a NumPy file, `.npz`, with the labels, and the number of lost ones as `lost`.

        An earlier file at `path` stays until the new one is complete.

        Raises:
            MiddlewareError: The file cannot be written.
        """
        path = Path(path)
        draft, made = path.with_name(f"{path.name}.{os.getpid()}.new"), False
        arrays: dict[str, Any] = {label: np.array(texts, dtype=str) for label, texts in self.labels.items()}
        arrays |= self.arrays()
        try:
            with draft.open("xb") as file:  # does not follow a link at this path
                made = True
                np.savez(file, lost=self.lost, **arrays)
            draft.rename(path)
        except OSError as error:
            raise _cannot_write(error, path) from error
        finally:
            with contextlib.suppress(OSError):
                if made:
                    draft.unlink()

    def close(self) -> None:
        """Discard everything that was not saved."""
        self._spool.close()

    def _fetch(self) -> int:
        """Fetch at most one batch."""
        ring, batch = self._ring, self._batch
        for place in range(BATCH):
            if not ring.read():
                return place
            batch[place] = ring.sequence, ring.stamp, ring.values
        return BATCH

    def _keep(self, number: int) -> None:
        """Write that many records of the batch to the file: all or none."""
        end = self.count * self._row.itemsize
        rest = self._batch[:number].view(np.uint8).data
        try:
            while rest:
                rest = rest[self._spool.write(rest) :]
        except OSError as error:
            self._dropped += number
            self._spool.seek(end)
            self._spool.truncate()
            raise _cannot_write(error, self._where) from error
        self.count += number


def _cannot_write(error: OSError, path: Path) -> MiddlewareError:
    return MiddlewareError(
        f"the recording cannot be written: {error.strerror}", where=str(path), expected="a file that you may write to"
    )


def _views(values: np.ndarray, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, np.ndarray]:
    """Return views of each source's part of a record, or of stacked records."""
    views, start = {}, 0
    for source, shape in shapes.items():
        end = start + int(np.prod(shape))
        views[source] = values[..., start:end].reshape(*values.shape[:-1], *shape)
        start = end
    return views

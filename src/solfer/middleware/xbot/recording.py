"""Makes a file of what a loop has taken down (`recorder.py`)."""

import contextlib
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.recorder import FILE, KIND, width_of
from solfer.middleware.xbot.ring import Ring
from solfer.middleware.xbot.segment import Segment

BATCH = 256
"""Records that are put into a file at once."""


class Recording:
    """The other end: what was taken down since it was opened, and what the memory still held then.

    What is drained goes at once to a file without a name, which nobody has to remove: a recording may be longer than
    the machine's memory.

    Args:
        folder: The namespace's folder.
        spool: Folder in which the file without a name is.

    Attributes:
        columns: Shapes of the sources by name, of those that were taken down.
        labels: Texts beside the numbers.
        count: Records that were drained.

    Raises:
        MiddlewareError: Nobody has recorded in this namespace, or there can be no file in `spool`.
    """

    def __init__(self, folder: Path, spool: Path | None = None):
        try:
            self._segment = Segment.attach(folder / FILE, KIND)
        except MiddlewareError as error:
            raise MiddlewareError(f"there is no recording: {error.what}", where=str(folder / FILE),
                                  expected="an RT layer in this namespace, with `record` above 0") from error
        layout = json.loads(self._segment.layout)
        self.columns = {source: tuple(shape) for source, shape in layout["columns"].items()}
        self.labels, self.count, self._dropped, self._same = layout["labels"], 0, 0, layout["same"]
        width = width_of(self.columns)
        self._ring = Ring(self._segment.data, width, layout["count"])
        # what was overwritten before anybody came is not lost; the oldest record may just be written over
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
        """Records that were overwritten before they were drained, or for which there was no room on the disk."""
        return self._ring.lost + self._dropped

    @property
    def over(self) -> bool:
        """Whether the one who records has ended, in good order or not."""
        return not self._segment.owned()

    def skip(self) -> None:
        """Leave out what the memory holds: the recording begins now."""
        self._ring.skip()

    def drain(self) -> int:
        """Fetch what is new; returns the number of records.

        Raises:
            MiddlewareError: There is no room on the disk: what could not be kept is lost, later records may not be.
        """
        before, full = self.count, True
        while full:
            number = self._fetch()
            self._keep(number)
            full = number == BATCH
        return self.count - before

    def arrays(self) -> dict[str, np.ndarray]:
        """What was drained: `time` on the recorder's clock [s], `cycle`, each source; records are the first axis."""
        rows = np.zeros(0, self._row)
        if self.count:
            rows = np.memmap(self._spool, self._row, "r", shape=(self.count,))
        views = _views(rows["values"], self.columns)
        same = {source: views[first] for source, first in self._same.items()}
        return {"time": 1e-9 * rows["time"], "cycle": rows["cycle"]} | views | same

    def save(self, path: str | Path) -> None:
        """Write what was drained to a file of NumPy, `.npz`, with the labels, and the number of lost records as `lost`.

        The file is there when it is whole; what stood at `path` before stays until then.

        Raises:
            MiddlewareError: The file cannot be written.
        """
        path = Path(path)
        draft = path.with_name(f"{path.name}.{os.getpid()}.new")
        labels = {label: np.array(texts, dtype=str) for label, texts in self.labels.items()}
        try:
            with draft.open("wb") as file:
                np.savez(file, lost=self.lost, **labels, **self.arrays())
            draft.rename(path)
        except OSError as error:
            raise _cannot_write(error, path) from error
        finally:
            with contextlib.suppress(OSError):
                draft.unlink()

    def close(self) -> None:
        """Let go of everything that was not saved."""
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
        """Put that many records of the batch into the file: all or none."""
        end = self.count * self._row.itemsize
        rest = self._batch[:number].view(np.uint8).data
        try:
            while rest:
                rest = rest[self._spool.write(rest):]
        except OSError as error:
            self._dropped += number
            self._spool.seek(end)
            self._spool.truncate()
            raise _cannot_write(error, self._where) from error
        self.count += number


def _cannot_write(error: OSError, path: Path) -> MiddlewareError:
    return MiddlewareError(f"the recording cannot be written: {error.strerror}", where=str(path))


def _views(values: np.ndarray, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, np.ndarray]:
    """The part of a record, or of records that are stacked, that belongs to each source."""
    views, start = {}, 0
    for source, shape in shapes.items():
        end = start + int(np.prod(shape))
        views[source] = values[..., start:end].reshape(*values.shape[:-1], *shape)
        start = end
    return views

"""Takes down what a loop works with: the loop writes into fixed memory, another process makes a file of it."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.ring import Ring
from solfer.middleware.xbot.segment import Segment

KIND = "recording"
SECONDS = 10.0
"""What the memory holds: a process that drains it may hang that long, and after a crash that much is left [s]."""


def _path(folder: Path, name: str) -> Path:
    return folder / f"recording.{name}"


class Recorder:
    """The loop's end: one record in each cycle. Never waits, allocates nothing; what is old is overwritten.

    Args:
        folder: The namespace's folder.
        name: Name of the recording.
        sources: Live arrays by name; their size does not change.
        rate: Cycles per second [Hz].
        seconds: What the memory holds [s].

    Raises:
        MiddlewareError: Another process records under this name, or the memory cannot be made.
    """

    def __init__(self, folder: Path, name: str, sources: Mapping[str, np.ndarray], rate: float,
                 seconds: float = SECONDS):
        shapes = {source: array.shape for source, array in sources.items()}
        width, count = _width(shapes), max(2, round(rate * seconds))
        layout = json.dumps({"columns": shapes, "count": count}).encode()
        self._segment = Segment.create(_path(folder, name), KIND, layout, Ring.size(width, count))
        self._ring = Ring(self._segment.data, width, count)
        self._pairs = list(zip(_views(self._ring.values, shapes).values(), sources.values(), strict=True))

    def take(self, time: int) -> None:
        """Take down all sources at `time` [ns]."""
        for view, source in self._pairs:
            np.copyto(view, source)
        self._ring.write(time)

    def close(self) -> None:
        """End the recording; what is not drained yet is lost."""
        self._segment.close()


class Recording:
    """The other end: what was taken down since it was opened, and what the memory still held then.

    Args:
        folder: The namespace's folder.
        name: Name of the recording.

    Attributes:
        columns: Shapes of the sources by name.

    Raises:
        MiddlewareError: Nobody has recorded under this name.
    """

    def __init__(self, folder: Path, name: str):
        self._path, self._times, self._rows = _path(folder, name), [], []
        self._segment = Segment.attach(self._path, KIND)
        layout = json.loads(self._segment.layout)
        self.columns = {source: tuple(shape) for source, shape in layout["columns"].items()}
        self._ring = Ring(self._segment.data, _width(self.columns), layout["count"])

    @property
    def lost(self) -> int:
        """Records that were overwritten before they were drained."""
        return self._ring.lost

    @property
    def over(self) -> bool:
        """Whether the one who records has ended, in good order or not."""
        return not self._segment.owned()

    def drain(self) -> int:
        """Fetch what is new; returns the number of records."""
        before = len(self._times)
        while self._ring.read():
            self._times.append(self._ring.stamp)
            self._rows.append(self._ring.values.copy())
        return len(self._times) - before

    def arrays(self) -> dict[str, np.ndarray]:
        """What was drained: `time` on the recorder's clock [s], and each source, with the records as first axis."""
        rows = np.array(self._rows) if self._rows else np.zeros((0, len(self._ring.values)))
        return {"time": 1e-9 * np.array(self._times, dtype=float)} | _views(rows, self.columns)

    def save(self, path: str | Path) -> None:
        """Write what was drained to a file of NumPy, `.npz`, with the number of lost records as `lost`.

        Raises:
            MiddlewareError: The file cannot be written.
        """
        try:
            np.savez(path, lost=self.lost, **self.arrays())
        except OSError as error:
            raise MiddlewareError(f"the recording cannot be written: {error.strerror}", where=str(path)) from error


def _width(shapes: Mapping[str, tuple[int, ...]]) -> int:
    return sum(int(np.prod(shape)) for shape in shapes.values())


def _views(values: np.ndarray, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, np.ndarray]:
    """The part of a record, or of records that are stacked, that belongs to each source."""
    views, start = {}, 0
    for source, shape in shapes.items():
        end = start + int(np.prod(shape))
        views[source] = values[..., start:end].reshape(*values.shape[:-1], *shape)
        start = end
    return views

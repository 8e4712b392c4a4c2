"""What the executor tells about itself, in memory that every process may look at."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.lifecycle import Stage
from solfer.middleware.xbot.segment import Segment
from solfer.middleware.xbot.timing import WIDTH, Histograms

FILE, KIND = "statistics", "statistics"
LOOP = ("cycle", "overhead", "lateness")
"""Histograms of the loop: a whole cycle, all of it but the components, and how late it began."""

COUNTS = ("cycles", "skipped", "overruns", "unforgiven", "time")
"""Words of the loop: cycles, periods left out, late ends in all and those not forgiven, and the time of the newest
cycle on the layer's clock [ns]."""

LIVES = ("stage", "starts", "aborts", "over budget")
"""Words of a plugin: its stage, and counts."""

TEXT = 256
"""Bytes of a text: first that of the loop, then the reason of each plugin."""


class Board:
    """Counts, histograms and texts over one stretch of memory.

    Args:
        rate: Cycles per second [Hz].
        plugins: Names of the plugins.
        stages: Names of the stages of a plugin's cycle.
        memory: Where all is kept; None: in memory of this process.

    Attributes:
        histograms: Rows `LOOP`, then `stages` of each plugin.
        skips: Periods that were left out because of each of these rows; a late wake-up is `lateness`.
        counts: Words of `COUNTS`, int64.
    """

    def __init__(self, rate: float, plugins: Sequence[str], stages: Sequence[str], memory: memoryview | None = None):
        self.rate, self.plugins, self.stages = rate, tuple(plugins), tuple(stages)
        words = len(COUNTS) + len(LIVES) * len(self.plugins)
        rows = len(LOOP) + len(self.stages) * len(self.plugins)
        self.size = 8 * words + 8 * rows * (WIDTH + 1) + TEXT * (1 + len(self.plugins))
        data = memory if memory is not None else memoryview(bytearray(self.size))
        self.counts = data[: 8 * len(COUNTS)].cast("q")
        self._lives = data[8 * len(COUNTS) : 8 * words].cast("q")
        self.histograms = Histograms(np.frombuffer(data[8 * words : 8 * (words + rows * WIDTH)], dtype=np.int64))
        self.skips = data[8 * (words + rows * WIDTH) : 8 * (words + rows * (WIDTH + 1))].cast("q")
        self._texts = data[8 * (words + rows * (WIDTH + 1)) : self.size]
        self._segment: Segment | None = None

    @classmethod
    def create(cls, folder: Path, rate: float, plugins: Sequence[str], stages: Sequence[str]) -> "Board":
        """A board in shared memory, for the executor.

        Raises:
            MiddlewareError: Another executor has it, or it cannot be made.
        """
        folder.mkdir(parents=True, exist_ok=True)
        layout = json.dumps({"rate": rate, "plugins": list(plugins), "stages": list(stages)}).encode()
        segment = Segment.create(folder / FILE, KIND, layout, cls(rate, plugins, stages).size)
        board = cls(rate, plugins, stages, segment.data)
        board._segment = segment
        return board

    @classmethod
    def attach(cls, folder: Path) -> "Board":
        """The board of an executor that runs, to look at.

        Raises:
            MiddlewareError: No executor runs in that namespace.
        """
        try:
            segment = Segment.attach(folder / FILE, KIND)
        except MiddlewareError as error:
            raise MiddlewareError(f"no RT layer to look at: {error.what}", where=str(folder / FILE),
                                  expected="`rosrun solfer xbot`, and its namespace") from error
        board = cls(**json.loads(segment.layout), memory=segment.data)
        board._segment = segment
        return board

    @property
    def alive(self) -> bool:
        """Whether the executor that owns it still runs."""
        return self._segment is None or self._segment.owned()

    @property
    def pid(self) -> int:
        """Process of the executor; 0: it is not shared."""
        return self._segment.pid if self._segment is not None else 0

    def beat(self, nanoseconds: int) -> None:
        """The executor lives at that time of the monotonic clock [ns]."""
        if self._segment is not None:
            self._segment.beat(nanoseconds)

    def row(self, plugin: int, stage: int) -> int:
        """Row of a stage of a plugin, by their indices."""
        return len(LOOP) + plugin * len(self.stages) + stage

    def life(self, plugin: int) -> dict[str, int]:
        """The words of a plugin, by name."""
        return {name: self._lives[plugin * len(LIVES) + place] for place, name in enumerate(LIVES)}

    def stage(self, plugin: int) -> Stage:
        """Where a plugin is in its life."""
        return Stage(self._lives[plugin * len(LIVES)])

    def put_life(self, plugin: int, *words: int) -> None:
        """Set the words of a plugin, in the order of `LIVES`."""
        first = plugin * len(LIVES)
        for place, word in enumerate(words):
            self._lives[first + place] = word

    def text(self, plugin: int | None = None) -> str:
        """The reason of a plugin's stage; None: what the loop says of itself."""
        place = 0 if plugin is None else 1 + plugin
        return bytes(self._texts[place * TEXT : (place + 1) * TEXT]).rstrip(b"\0").decode(errors="replace")

    def put_text(self, text: str, plugin: int | None = None) -> None:
        """Set a text; what is too long is cut off."""
        place = 0 if plugin is None else 1 + plugin
        self._texts[place * TEXT : (place + 1) * TEXT] = text.encode(errors="replace")[:TEXT].ljust(TEXT, b"\0")

    def close(self) -> None:
        """Let go of the memory."""
        if self._segment is not None:
            self._segment.close()

"""Statistics of the executor, in memory that every process may read."""

import enum
import json
from collections.abc import Mapping, Sequence
from itertools import accumulate
from pathlib import Path

import numpy as np

from solfer.dynamics import BIAS, INERTIA, INERTIA_INVERSE
from solfer.errors import MiddlewareError
from solfer.segments.segment import Segment
from solfer.telemetry import STATISTICS
from solfer.telemetry.histograms import ROW_WORDS
from solfer.transport.plugin_state import PluginState

EXECUTOR = "xbotcore"
"""Owner of the services and reports of a whole RT layer."""


class LoopTime(enum.IntEnum):
    """Histograms of the loop: a whole cycle, all of it but the components, and how late it began."""

    CYCLE = 0
    OVERHEAD = 1
    LATENESS = 2


class LoopCount(enum.IntEnum):
    """Words of the loop.

    CYCLES; SKIPPED periods; OVERRUNS: all late ends; UNFORGIVEN: those not forgiven; TIME of the newest cycle on the
    layer's clock [ns].
    """

    CYCLES = 0
    SKIPPED = 1
    OVERRUNS = 2
    UNFORGIVEN = 3
    TIME = 4


class PluginCount(enum.IntEnum):
    """Words of a plugin: its `PluginState`, and counts."""

    STATE = 0
    STARTS = 1
    ABORTS = 2
    OVER_BUDGET = 3


COMPUTED = ("kinematics", "center_of_mass", "contacts", "center_of_pressure", BIAS, INERTIA, INERTIA_INVERSE)
"""What a Robot computes, as `Robot.computations` names it: further words of a plugin."""

PLUGIN_WORDS = len(PluginCount) + len(COMPUTED)
"""Words of a plugin."""

LOOP_HISTOGRAMS = tuple(each.name.lower() for each in LoopTime)
"""Names of the histograms of the loop."""

TEXT_BYTES = 256
"""Bytes of a text: first that of the loop, then the reason of each plugin."""


class RuntimeStatistics:
    """Counts, histograms and texts in one block of memory.

    Args:
        rate: Cycles per second [Hz].
        plugins: Names of the plugins.
        stages: Names of the stages of a plugin's cycle.
        memory: The memory; None: memory of this process.

    Attributes:
        histograms: Rows by `LoopTime`, then `stages` of each plugin, int64, shape (rows, ROW_WORDS).
        skips: Periods that were skipped because of each of these rows; a late wake-up counts for `lateness`.
        counts: Words by `LoopCount`, int64.
        segments: The segment of shared memory; none if it is not shared.
    """

    def __init__(self, rate: float, plugins: Sequence[str], stages: Sequence[str], memory: memoryview | None = None):
        self.rate = rate
        self.plugins = tuple(plugins)
        self.stages = tuple(stages)
        rows = len(LOOP_HISTOGRAMS) + len(self.stages) * len(self.plugins)
        words = (len(LoopCount), PLUGIN_WORDS * len(self.plugins), ROW_WORDS * rows, rows)
        ends = [8 * end for end in accumulate(words)]
        self.size = ends[-1] + TEXT_BYTES * (1 + len(self.plugins))
        data = memory if memory is not None else memoryview(bytearray(self.size))
        parts = [data[end - 8 * size : end].cast("q") for end, size in zip(ends, words, strict=True)]
        self.counts, self._lives, histograms, self.skips = parts
        self.histograms = np.frombuffer(histograms, dtype=np.int64).reshape(rows, ROW_WORDS)
        self._texts = data[ends[-1] : self.size]
        self.segments: tuple[Segment, ...] = ()

    @classmethod
    def create(cls, folder: Path, rate: float, plugins: Sequence[str], stages: Sequence[str]) -> "RuntimeStatistics":
        """Create statistics in shared memory, for the executor.

        Raises:
            MiddlewareError: Another executor owns them, or the memory cannot be made.
        """
        layout = json.dumps({"rate": rate, "plugins": list(plugins), "stages": list(stages)}).encode()
        return cls._in(Segment.create(folder / STATISTICS, STATISTICS, layout, size=cls(rate, plugins, stages).size))

    @classmethod
    def attach(cls, folder: Path) -> "RuntimeStatistics":
        """Attach to the statistics of a running executor, to read them.

        Raises:
            MiddlewareError: No executor runs in that namespace.
        """
        try:
            return cls._in(Segment.attach(folder / STATISTICS, STATISTICS))
        except MiddlewareError as error:
            raise MiddlewareError(
                f"no RT layer to look at: {error.what}",
                where=str(folder / STATISTICS),
                expected="`rosrun solfer xbot`, and its namespace",
            ) from error

    @classmethod
    def _in(cls, segment: Segment) -> "RuntimeStatistics":
        statistics = cls(**json.loads(segment.layout), memory=segment.data)
        statistics.segments = (segment,)
        return statistics

    @property
    def alive(self) -> bool:
        """Whether the executor that owns the memory still runs."""
        return all(segment.owned() for segment in self.segments)

    @property
    def pid(self) -> int:
        """Process of the executor; 0: it is not shared."""
        return self.segments[0].pid if self.segments else 0

    def beat(self, nanoseconds: int) -> None:
        """Write the executor's heartbeat, a time of the monotonic clock [ns]."""
        for segment in self.segments:
            segment.beat(nanoseconds)

    def row(self, plugin: int, stage: int) -> int:
        """Return the row of a stage of a plugin, by their indices."""
        return len(LOOP_HISTOGRAMS) + plugin * len(self.stages) + stage

    def life(self, plugin: int) -> memoryview:
        """Return the words of a plugin: by `PluginCount`, then those of COMPUTED."""
        return self._lives[plugin * PLUGIN_WORDS : (plugin + 1) * PLUGIN_WORDS]

    def state(self, plugin: int) -> PluginState:
        """Return the state of a plugin's life."""
        return PluginState(self.life(plugin)[PluginCount.STATE])

    def computed(self, plugin: int) -> dict[str, int]:
        """Return how often each of COMPUTED was computed for a plugin's Robot."""
        return dict(zip(COMPUTED, self.life(plugin)[len(PluginCount) :], strict=True))

    def put_life(self, plugin: int, state: PluginState, starts: int, aborts: int, over_budget: int) -> None:
        """Set the words of a plugin."""
        life = self.life(plugin)
        for word, value in zip(PluginCount, (state, starts, aborts, over_budget), strict=True):
            life[word] = value

    def put_computed(self, plugin: int, counts: Mapping[str, int]) -> None:
        """Set how often each of COMPUTED was computed for a plugin's Robot; what is not among `counts` stays."""
        life = self.life(plugin)
        for place, name in enumerate(COMPUTED, len(PluginCount)):
            life[place] = counts.get(name, life[place])

    def text(self, plugin: int | None = None) -> str:
        """Return the reason of a plugin's state; None: the text of the loop, its scheduling."""
        return bytes(self._text(plugin)).rstrip(b"\0").decode(errors="replace")

    def put_text(self, text: str, plugin: int | None = None) -> None:
        """Set a text; it is cut off at TEXT_BYTES."""
        self._text(plugin)[:] = text.encode(errors="replace")[:TEXT_BYTES].ljust(TEXT_BYTES, b"\0")

    def _text(self, plugin: int | None) -> memoryview:
        place = 0 if plugin is None else 1 + plugin
        return self._texts[place * TEXT_BYTES : (place + 1) * TEXT_BYTES]

    def close(self) -> None:
        """Release the memory."""
        for segment in self.segments:
            segment.close()

"""Plots of columns that the user picks."""

from collections import deque

import numpy as np
from viser import GuiApi, GuiUplotHandle, uplot

from solfer_tools.view.columns import PlottedColumns
from solfer_tools.view.commands.requests import PageRequests
from solfer_tools.view.incoming import IncomingMessages

COLORS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf")
"""Of the columns of a plot, which has as many at most."""

NO_COLUMN = "(none)"


class Plots:
    """A plot, and the columns that may be in it.

    Args:
        gui: Where it is.
        requests: Carries out what the user picks.
        columns: All columns.
        incoming: Lets pages change it.
    """

    def __init__(self, gui: GuiApi, requests: PageRequests, columns: PlottedColumns, incoming: IncomingMessages):
        self._gui = gui
        self._columns = columns
        self._times = deque[float]()
        self._samples: dict[str, deque[float]] = {}
        self._plot: GuiUplotHandle | None = None
        self._drawn = -np.inf
        with gui.add_folder("plot", expand_by_default=False) as self._folder:
            self._choice = gui.add_dropdown("column", (NO_COLUMN,))
            add = gui.add_button("add")
            clear = gui.add_button("clear")
        incoming.display |= {self._choice._impl.uuid, add._impl.uuid, clear._impl.uuid}

        @add.on_click
        async def _(_: object) -> None:
            requests.submit("add", self._add)

        @clear.on_click
        async def _(_: object) -> None:
            requests.submit("clear", self._clear)

    def update(self, now: float) -> None:
        """Take a sample at some time [s]; where time goes back the plot begins again."""
        if self._times and now < self._times[-1]:
            for kept in (self._times, *self._samples.values()):
                kept.clear()
        names = self._columns.names()
        if len(names) + 1 != len(self._choice.options):
            self._choice.options = (NO_COLUMN, *names)
        self._times.append(now)
        for name, samples in self._samples.items():
            samples.append(self._columns.value(name))
        while self._times[0] < now - 20.0:  # [s]
            for kept in (self._times, *self._samples.values()):
                kept.popleft()
        if self._plot is not None and abs(now - self._drawn) >= 0.2:  # [s]
            self._drawn = now
            self._plot.data = self._data()

    def _add(self) -> None:
        name = self._choice.value
        if name != NO_COLUMN and name not in self._samples and len(self._samples) < len(COLORS):
            self._samples[name] = deque([np.nan] * len(self._times))
            self._draw()

    def _clear(self) -> None:
        self._samples.clear()
        self._draw()

    def _draw(self) -> None:
        if self._plot is not None:
            self._plot.remove()
            self._plot = None
        if not self._samples:
            return
        lines = (uplot.Series(label=name, stroke=color) for name, color in zip(self._samples, COLORS, strict=False))
        with self._folder:
            self._plot = self._gui.add_uplot(
                self._data(),
                (uplot.Series(label="time [s]"), *lines),
                scales={"x": uplot.Scale(time=False)},
                aspect=1.4,
            )

    def _data(self) -> tuple[np.ndarray, ...]:
        return tuple(np.array(each) for each in (self._times, *self._samples.values()))

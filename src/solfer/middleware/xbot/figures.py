"""The figures of an RT layer for somebody who looks at it from outside, again and again."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.board import LOOP, Board
from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.timing import Histograms


@dataclass(frozen=True)
class StageFigures:
    """Times of a stage.

    Attributes:
        name: Name of the stage.
        count: Cycles in which it was reached, since the start.
        median, p99: Of those since the look before [s].
        longest: Since the start [s].
        skipped: Periods that were left out because of it, since the start.
    """

    name: str
    count: int
    median: float
    p99: float
    longest: float
    skipped: int


@dataclass(frozen=True)
class PluginFigures:
    """A plugin: its stage of life and why, counts since the start, and the stages of its cycle."""

    name: str
    stage: str
    reason: str
    starts: int
    aborts: int
    over_budget: int
    stages: tuple[StageFigures, ...]


@dataclass(frozen=True)
class LayerFigures:
    """The layer: its process and whether it lives, rate [Hz], what the kernel granted, why the emergency stop is
    tripped, counts since the start, the stages of the loop, and the plugins.
    """

    process: int
    alive: bool
    rate: float
    scheduling: str
    emergency_stop: str
    cycles: int
    skipped: int
    overruns: int
    unforgiven: int
    loop: tuple[StageFigures, ...]
    plugins: tuple[PluginFigures, ...]


class Observer:
    """Looks at the layer of a namespace, which may come, end and come back. Costs the layer nothing.

    Args:
        folder: The namespace's folder.
    """

    def __init__(self, folder: Path):
        self._folder, self._process = folder, 0
        self._earlier: np.ndarray | None = None

    def look(self) -> LayerFigures | None:
        """The figures at present; None if no layer was started, or it has ended in good order."""
        try:
            board = Board.attach(self._folder)
            stop = EmergencyStop(self._folder).reason
        except MiddlewareError:
            return None
        now = board.histograms.snapshot()
        if board.pid != self._process or self._earlier is None or self._earlier.shape != now.shape:
            self._process, self._earlier = board.pid, np.zeros_like(now)
        recent, self._earlier = Histograms(now).since(self._earlier), now
        cycles, skipped, overruns, unforgiven = board.counts[:4]
        loop = tuple(_stage(board, recent, row, name) for row, name in enumerate(LOOP))
        plugins = tuple(_plugin(board, recent, index) for index in range(len(board.plugins)))
        return LayerFigures(board.pid, board.alive, board.rate, board.text(), stop, cycles, skipped, overruns,
                            unforgiven, loop, plugins)


def _plugin(board: Board, recent: Histograms, index: int) -> PluginFigures:
    stages = tuple(_stage(board, recent, board.row(index, place), name) for place, name in enumerate(board.stages))
    starts, aborts, over_budget = list(board.life(index).values())[1:]
    return PluginFigures(board.plugins[index], board.stage(index).name, board.text(index), starts, aborts, over_budget,
                         stages)


def _stage(board: Board, recent: Histograms, row: int, name: str) -> StageFigures:
    return StageFigures(name, board.histograms.count(row), 1e-9 * recent.quantile(row, 0.5),
                        1e-9 * recent.quantile(row, 0.99), 1e-9 * board.histograms.longest(row), board.skips[row])

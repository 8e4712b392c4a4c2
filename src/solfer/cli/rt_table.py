"""The tables of `solfer rt`."""

from collections.abc import Iterator

from solfer.middleware.xbot.board import LOOP, Board

QUANTILES = (0.5, 0.99)


def heading(board: Board, estop: str = "") -> Iterator[str]:
    """Lines about the whole layer; `estop` is why the emergency stop is tripped."""
    cycles, skipped, overruns = board.counts[:3]
    life = "" if board.alive else " HAS ENDED"
    yield (f"process {board.pid}{life}, {board.rate:g} Hz, {cycles} cycles, {skipped} periods skipped, "
           f"{overruns} overruns")
    yield f"scheduling: {board.text() or 'not asked for'}"
    yield f"emergency stop: {estop or 'no'}"


def rows(board: Board) -> Iterator[tuple[str, ...]]:
    """Times of the loop, and of the plugins and their stages [us], and the periods that were left out for each."""
    yield "[us]", "stage", "count", "p50", "p99", "max", "skips"
    for row, name in enumerate(LOOP):
        yield "loop", name, *_figures(board, row)
    for plugin, name in enumerate(board.plugins):
        for stage, title in enumerate(board.stages):
            yield name, title, *_figures(board, board.row(plugin, stage))


def states(board: Board) -> Iterator[tuple[str, ...]]:
    """Where each plugin is in its life, how often it was started, aborted and over its budget, and why."""
    yield "plugin", "stage", "starts", "aborts", "over budget", "why"
    for plugin, name in enumerate(board.plugins):
        counts = list(board.life(plugin).values())[1:]
        yield name, board.stage(plugin).name, *map(str, counts), board.text(plugin)


def _figures(board: Board, row: int) -> tuple[str, ...]:
    times = [board.histograms.quantile(row, share) for share in QUANTILES] + [board.histograms.longest(row)]
    count, skips = board.histograms.count(row), board.skips[row]
    return str(count), *(f"{1e-3 * time:.1f}" for time in times), str(skips)

"""Figures, and where they go: PNG, PDF or a window."""

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from solfer.errors import MissingDependency, RecordingError, writing
from solfer.installation import pip_install

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

LINE_POINTS = 2000  # points of a line; more are neither seen nor quickly drawn
FONT_SIZE = 8.0  # of all text but the title of a page [pt]

COLUMN_WIDTH = 3.5
"""Width of a column of a paper [inch]."""

# Okabe and Ito's colours, which people with a weakness for red and green distinguish
FIRST_COLOR = "#0072B2"
SECOND_COLOR = "#009E73"
DESIRED_COLOR = "#E69F00"
WRONG_COLOR = "#D55E00"
COLORS = (FIRST_COLOR, WRONG_COLOR, SECOND_COLOR, "#CC79A7", DESIRED_COLOR, "#56B4E9", "#000000", "#F0E442")


def new_figure(width: float, height: float) -> "Figure":
    """Make an empty figure of a size [inch]; one of a column's width is printed, and has 300 pixels to the inch.

    Raises:
        MissingDependency: matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingDependency("pictures need matplotlib", expected=pip_install("matplotlib")) from error
    return Figure(figsize=(width, height), dpi=110 if width > COLUMN_WIDTH else 300, layout="constrained")


def time_plots(place: "Figure | SubFigure", count: int, across: int) -> list["Axes"]:
    """Make plots with one time axis, in rows of `across`; only the lowest of each column shows its ticks."""
    across = max(1, min(across, count))
    grid = place.subplots(-(-count // across), across, sharex=True, squeeze=False).ravel()
    for axes in grid[count:]:
        axes.remove()
    for index, axes in enumerate(grid[:count]):
        axes.tick_params(labelbottom=index + across >= count)
    return list(grid[:count])


def draw(axes: "Axes", times: np.ndarray, values: np.ndarray, **style: Any) -> None:
    """Draw a line; of many points those that its outline needs: the lowest and the highest of each stretch.

    Args:
        axes: Where.
        times: Shape (T,) [s].
        values: Shape (T,).
        **style: As for `Axes.plot`; without a colour the next of `COLORS`, dashed once all are used.
    """
    kept = outline(values)
    if "color" not in style:
        turn, index = divmod(len(axes.get_lines()), len(COLORS))
        style = {"color": COLORS[index], "ls": ("-", "--", ":")[min(turn, 2)], **style}
    axes.plot(times[kept], values[kept], **style)


def outline(values: np.ndarray) -> np.ndarray:
    """Return indices of at most about `LINE_POINTS` points that look like all of them, ascending."""
    count = len(values)
    if count <= LINE_POINTS:
        return np.arange(count)
    stretch = -(-2 * count // LINE_POINTS)
    whole = count // stretch * stretch
    rows = values[:whole].reshape(-1, stretch)
    filled = np.where(np.isfinite(rows), rows, 0.0)
    starts = np.arange(0, whole, stretch)
    return np.unique([0, count - 1, *(starts + filled.argmin(axis=1)), *(starts + filled.argmax(axis=1))])


def dress(axes: "Axes", title: str, label: str = "") -> None:
    """Give axes a title on the left, a label of y, small ticks and a grid."""
    characters = 40 if is_column(axes.figure) else 100  # of a line
    axes.set_title(textwrap.fill(title, characters), fontsize=FONT_SIZE, loc="left")
    axes.set_ylabel(label, fontsize=FONT_SIZE)
    axes.tick_params(labelsize=FONT_SIZE)
    axes.grid(alpha=0.3, linewidth=0.5)
    axes.margins(x=0.0)


def legend(axes: "Axes") -> None:
    """Add the legend of the lines: beside the plot, or below it in a paper's column."""
    style: dict[str, Any] = {"fontsize": FONT_SIZE, "frameon": False}
    if is_column(axes.figure):
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=2.0, ncols=2, **style)
    else:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), **style)


def is_column(place: "Figure | SubFigure") -> bool:
    """Whether a page is for a paper's column."""
    return place.figure.get_figwidth() <= COLUMN_WIDTH


def save(figures: Sequence[tuple[str, "Figure"]], path: Path) -> None:
    """Write figures; see `saved`."""
    for _ in saved(figures, path):
        pass


def saved(figures: Sequence[tuple[str, "Figure"]], path: Path) -> Iterator[Path]:
    """Write figures: all of them into a PDF, or a PNG for each, with its name in that of the file if there are several.

    Args:
        figures: Names and figures.
        path: The file.

    Yields:
        The file of each figure.

    Raises:
        RecordingError: The suffix is neither .pdf nor .png, or a file cannot be written.
    """
    check_suffix(path)
    with writing("the picture", path, RecordingError):
        if path.suffix == ".pdf":
            from matplotlib.backends.backend_pdf import PdfPages

            with PdfPages(path) as pages:
                for _, figure in figures:
                    pages.savefig(figure)
                    yield path
            return
        for name, figure in figures:
            file = path.with_name(f"{path.stem}_{name}.png") if len(figures) > 1 else path
            figure.savefig(file)
            yield file


def check_suffix(path: Path) -> None:
    """Check that a file is one that `save` writes.

    Raises:
        RecordingError: The suffix is neither .pdf nor .png.
    """
    suffixes = (".pdf", ".png")
    if path.suffix not in suffixes:
        raise RecordingError(
            f"pictures of the kind '{path.suffix}'",
            where=str(path),
            expected=f"a file that ends with {' or '.join(suffixes)}",
        )


def show(figures: Sequence[tuple[str, "Figure"]]) -> None:
    """Show figures in windows until they are closed.

    Raises:
        RecordingError: There is no screen.
    """
    import matplotlib.pyplot as plt
    from matplotlib import backends

    if plt.get_backend().lower() in backends.backend_registry.list_builtin(backends.BackendFilter.NON_INTERACTIVE):
        raise RecordingError("there is no screen for a window", expected="`-o OUT.png` or `-o OUT.pdf`")
    for name, figure in figures:
        figure.set_dpi(110)  # a page for a printer has more
        manager = plt.figure(name, figsize=figure.get_size_inches()).canvas.manager
        figure.set_canvas(manager.canvas)
        manager.canvas.figure = figure
    plt.show()

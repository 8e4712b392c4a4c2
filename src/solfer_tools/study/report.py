"""The page of a study: one HTML file with its table, distributions, maps over two variables, and its worst runs."""

import base64
import html
import io
import itertools
import json
import math
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from solfer.errors import StudyError, UnknownName
from solfer_tools.review import FIRST_COLOR, FONT_SIZE, WRONG_COLOR, check_suffix, new_figure, save
from solfer_tools.study.folder import RECORDING, RUNS, StudyFolder, write_whole, writing_to

if TYPE_CHECKING:
    from solfer_tools.review import Figure

STYLE = """
body { font: 14px/1.45 sans-serif; margin: 2em auto; max-width: 72em; padding: 0 1em; color: #222 }
table { border-collapse: collapse; font-size: 12px; font-variant-numeric: tabular-nums }
th, td { padding: 2px 8px; text-align: right; border-bottom: 1px solid #ddd }
th { position: sticky; top: 0; background: #fff; cursor: pointer } tr.failed td { color: #b2182b }
.pictures { display: flex; flex-wrap: wrap; gap: 12px } code { background: #f3f3f3; padding: 1px 4px }
.rows { max-height: 40em; overflow: auto }
"""

SORT = """
const key = (row, place) => {
  const text = row.cells[place].textContent, number = parseFloat(text)
  return isNaN(number) ? text : number
}
for (const head of document.querySelectorAll('th')) head.onclick = () => {
  const body = head.closest('table').tBodies[0], place = head.cellIndex
  const sign = (head.dataset.down = head.dataset.down ? '' : '1') ? -1 : 1
  body.append(...[...body.rows].sort((a, b) => sign * (key(a, place) > key(b, place) ? 1 : -1)))
}
"""

Row = Mapping[str, Any]


def write_report(folder: StudyFolder) -> Path:
    """Write the page, `report.html`, and return its path.

    Raises:
        StudyError: There is no result yet, or the page cannot be written.
        MissingDependency: matplotlib is not installed.
    """
    rows = list(folder.rows())
    if not rows:
        raise StudyError("there is no result yet", where=str(folder.path), expected="a study that has run")
    record = folder.study.record
    failed = [row for row in rows if row["failed"]]
    title = Path(folder.study.file).stem
    parts = [
        f"<h1>{html.escape(title)}</h1>",
        f"<p>{html.escape(record.description)}</p>" if record.description else "",
        f"<p>{len(rows)} of {len(folder.runs)} runs, {len(failed)} failed. Code <code>{folder.code}</code>.</p>",
        _summary(rows, list(record.measure)),
        _section("Distributions", [_histogram(rows, name) for name in record.measure]),
        _section("Maps", _maps(rows, folder.study.names, list(record.measure))),
        _worst(folder, rows),
        _table(rows),
    ]
    page = f"<!doctype html><html><head><meta charset=utf-8><title>{html.escape(title)}</title>"
    page += f"<style>{STYLE}</style></head><body>{''.join(parts)}<script>{SORT}</script></body></html>\n"
    file = folder.path / "report.html"
    with writing_to(file):
        write_whole(file, page.encode())
    return file


def numbers(rows: Sequence[Row], name: str) -> np.ndarray:
    """Return the numbers of a column, NaN where there is none, shape (n,)."""
    return np.array([_number(row.get(name)) for row in rows])


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def _summary(rows: Sequence[Row], measures: Sequence[str]) -> str:
    """Return the table of mean, deviation and quantiles of each measure, of the runs that did not fail."""
    heads = ("measure", "runs", "mean", "deviation", "minimum", "median", "95 %", "maximum")
    lines = []
    for name in measures:
        values = numbers([row for row in rows if not row["failed"]], name)
        values = values[np.isfinite(values)]
        if len(values):
            figures = (values.mean(), values.std(), *np.quantile(values, (0.0, 0.5, 0.95, 1.0)))
            lines.append([name, str(len(values)), *(f"{each:.4g}" for each in figures)])
    return _html_table(heads, lines)


def _histogram(rows: Sequence[Row], name: str) -> str:
    """Draw the distribution of a measure, of runs that failed in another colour."""
    values = numbers(rows, name)
    failed = np.array([bool(row["failed"]) for row in rows])
    counts = np.isfinite(values)
    if not counts.any():
        return ""
    figure = new_figure(3.4, 2.2)
    axes = figure.add_subplot()
    parts = [values[counts & ~failed], values[counts & failed]]
    axes.hist(parts, bins=30, stacked=True, color=[FIRST_COLOR, WRONG_COLOR])
    axes.set_xlabel(name)
    axes.set_ylabel("runs")
    return _picture(figure)


def _maps(rows: Sequence[Row], names: Sequence[str], measures: Sequence[str]) -> list[str]:
    """Draw each measure, and the fraction of runs that failed, over each two variables."""
    varying = [name for name in names if len({str(row.get(name)) for row in rows}) > 1]
    pairs = list(itertools.combinations(varying, 2))
    found = []
    for measure in ("failed", *measures):
        values = _of_good(rows, measure)
        found += [
            _picture(_map(rows, first, second, measure=measure, values=values))
            for first, second in pairs[:6]  # more would bury the page
        ]
    return found


def write_map(folder: StudyFolder, first: str, second: str, measure: str, out: Path) -> None:
    """Draw the mean of a measure over two variables; `failed` is the fraction of runs that failed.

    Raises:
        UnknownName: There is no such variable, or no such measure.
        RecordingError: The picture cannot be written.
        MissingDependency: matplotlib is not installed.
    """
    names = folder.study.names
    measures = ["failed", *folder.study.record.measure]
    for name in (first, second):
        if name not in names:
            raise UnknownName("variable", name, names, where="--map")
    if measure not in measures:
        raise UnknownName("measure", measure, measures, where="--map")
    rows = list(folder.rows())
    check_suffix(out)
    save([(measure, _map(rows, first, second, measure=measure, values=_of_good(rows, measure)))], out)


def _of_good(rows: Sequence[Row], measure: str) -> np.ndarray:
    """Return a measure of the runs that did not fail, NaN for the others, shape (n,); of `failed` all."""
    values = numbers(rows, measure)
    return values if measure == "failed" else np.where(numbers(rows, "failed") > 0, np.nan, values)


def _map(rows: Sequence[Row], first: str, second: str, measure: str, values: np.ndarray) -> "Figure":
    """Draw the mean of a measure over two variables."""
    (across, across_names), (up, up_names) = _levels(rows, first), _levels(rows, second)
    shape = (len(up_names), len(across_names))
    finite = np.isfinite(values)
    place = np.ravel_multi_index((up[finite], across[finite]), shape)
    with np.errstate(invalid="ignore"):  # NaN where there is no run
        mean = np.bincount(place, values[finite], math.prod(shape)) / np.bincount(place, minlength=math.prod(shape))
    figure = new_figure(3.4, 2.6)
    axes = figure.add_subplot()
    image = axes.imshow(mean.reshape(shape), origin="lower", aspect="auto", cmap="viridis")
    axes.set_xticks(range(len(across_names)), across_names, rotation=45)
    axes.set_yticks(range(len(up_names)), up_names)
    axes.set_xlabel(first)
    axes.set_ylabel(second)
    figure.colorbar(image, label="fraction that failed" if measure == "failed" else measure)
    return figure


def _levels(rows: Sequence[Row], name: str) -> tuple[np.ndarray, list[str]]:
    """Return the level of a variable in each row, shape (n,), and the names of the levels."""
    values = numbers(rows, name)
    distinct = sorted({str(row.get(name)) for row in rows}, key=lambda text: (_number(text), text))
    most = 12  # of more values the range is cut into as many pieces
    if len(distinct) <= most or not np.isfinite(values).all():
        place = {text: index for index, text in enumerate(distinct)}
        return np.array([place[str(row.get(name))] for row in rows]), distinct
    edges = np.linspace(values.min(), values.max(), most + 1)
    level = np.clip(np.digitize(values, edges) - 1, 0, most - 1)
    return level, [f"{(low + high) / 2:.3g}" for low, high in itertools.pairwise(edges)]


def _worst(folder: StudyFolder, rows: Sequence[Row]) -> str:
    """Return the runs that failed, and those with the largest first measure, each with its plot and its command."""
    measures = list(folder.study.record.measure)
    search = folder.study.record.search
    goal = (search.minimize or search.maximize) if search is not None else next(iter(measures), "")
    sign = -1.0 if search is not None and search.maximize else 1.0
    size = np.nan_to_num(sign * numbers(rows, str(goal)), nan=-math.inf)
    order = sorted(range(len(rows)), key=lambda place: (-rows[place]["failed"], -size[place]))
    items = []
    for place in order[:5]:
        row = rows[place]
        command = (
            f"solfer study {shlex.quote(folder.study.file)} --out {shlex.quote(str(folder.path))} --rerun {row['id']}"
        )
        figures = ", ".join(f"{name} {_shown(row.get(name))}" for name in (*folder.study.names, *measures))
        reason = f"<br>failed: {html.escape(row['failure'])}" if row["failed"] else ""
        items.append(
            f"<h3>run {row['run']}</h3><p>{html.escape(figures)}{reason}<br><code>{html.escape(command)}</code></p>"
            + _plot(folder, row["id"])
        )
    return f"<h2>Worst runs</h2>{''.join(items)}"


def _plot(folder: StudyFolder, run_id: str) -> str:
    """Draw the columns of a run over time; empty where it has none."""
    columns = folder.columns(run_id)
    if columns is None:
        return ""
    times, names, values = columns
    if not names or not len(times):
        return ""
    run = folder.path / RUNS / run_id
    across = min(3, len(names))
    down = -(-len(names) // across)
    figure = new_figure(3.6 * across, 1.6 * down)
    for place, (name, column) in enumerate(zip(names, values, strict=True)):
        axes = figure.add_subplot(down, across, place + 1)
        axes.plot(times, column, color=FIRST_COLOR, linewidth=1.0)
        axes.set_title(name, fontsize=FONT_SIZE)
        axes.tick_params(labelsize=FONT_SIZE)
    axes.set_xlabel("time [s]", fontsize=FONT_SIZE)
    recorded = (
        f"<p>recording: <code>{html.escape(str(run / RECORDING))}</code></p>" if (run / RECORDING).exists() else ""
    )
    return _picture(figure) + recorded


def _table(rows: Sequence[Row]) -> str:
    heads = list(rows[0])
    shown = rows[:2000]
    lines = [[_shown(row.get(name)) for name in heads] for row in shown]
    marks = ["failed" if row["failed"] else "" for row in shown]
    left = len(rows) - len(shown)
    more = f"<p>{left} more are in <code>table.csv</code>.</p>" if left else ""
    return f"<h2>Runs</h2><div class=rows>{_html_table(heads, lines, marks)}</div>{more}"


def _html_table(heads: Sequence[str], lines: Sequence[Sequence[str]], marks: Sequence[str] = ()) -> str:
    top = "".join(f"<th>{html.escape(head)}</th>" for head in heads)
    body = "".join(
        f"<tr class={marks[place] if marks and marks[place] else 'run'}>"
        + "".join(f"<td>{html.escape(cell)}</td>" for cell in line)
        + "</tr>"
        for place, line in enumerate(lines)
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def _section(title: str, parts: Sequence[str]) -> str:
    return f"<h2>{title}</h2><div class=pictures>{''.join(parts)}</div>" if any(parts) else ""


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.5g}"
    return "" if value is None else value if isinstance(value, str) else json.dumps(value)


def _picture(figure: Any) -> str:
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=90)
    return f'<img src="data:image/png;base64,{base64.b64encode(content.getvalue()).decode()}">'

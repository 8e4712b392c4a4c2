"""The page of a study, one HTML file: best run, distributions, importance of variables, maps, worst runs, table."""

import base64
import html
import io
import itertools
import math
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import rankdata

from solfer.config.loading.layers import ROOT
from solfer.config.yaml.edit import edited
from solfer.config.yaml.nodes import Key
from solfer.errors import StudyError, UnknownName
from solfer_tools.review import FIRST_COLOR, FONT_SIZE, SECOND_COLOR, WRONG_COLOR, check_suffix, new_figure, save
from solfer_tools.study.folder import RECORDING, RUNS, StudyFolder, write_whole, writing_to
from solfer_tools.study.plan import CONFIGURATION_KEY, Study, shown

if TYPE_CHECKING:
    from solfer_tools.review import Figure

STYLE = """
body { font: 14px/1.45 sans-serif; margin: 2em auto; max-width: 72em; padding: 0 1em; color: #222 }
table { border-collapse: collapse; font-size: 12px; font-variant-numeric: tabular-nums }
th, td { padding: 2px 8px; text-align: right; white-space: nowrap; border-bottom: 1px solid #ddd }
th { position: sticky; top: 0; background: #fff; cursor: pointer } tr.failed td { color: #b24a00 }
pre { background: #f3f3f3; padding: 6px 8px; overflow: auto } img { max-width: 100% }
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
    title = html.escape(Path(folder.study.file).stem)
    varying = [name for name in folder.study.names if len({str(row.get(name)) for row in rows}) > 1]
    parts = [
        f"<h1>{title}</h1>",
        f"<p>{html.escape(record.description)}</p>" if record.description else "",
        f"<p>{len(rows)} of {len(folder.runs)} runs, {len(failed)} failed. Code <code>{folder.code}</code>.</p>",
        *_best(folder, rows),
        _summary(folder.study, rows),
        _section("Distributions", [_histogram(folder.study, rows, name) for name in record.measure]),
        _importance(rows, varying, list(record.measure)),
        _section("Measures by variables", _scatter_plots(folder.study, rows, varying)),
        _section("Maps", _maps(folder.study, rows, varying)),
        _worst(folder, rows),
        _table(folder, rows),
    ]
    head = "<meta charset=utf-8><meta name=viewport content='width=device-width, initial-scale=1'>"
    page = f"<!doctype html><html lang=en><head>{head}<title>{title}</title><style>{STYLE}</style></head>"
    page += f"<body>{''.join(parts)}<script>{SORT}</script></body></html>\n"
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


def _label(study: Study, name: str) -> str:
    """Return the name of a measure or variable with its unit."""
    record = study.record.measure.get(name) or study.variations.get(name)
    return f"{name} [{record.unit}]" if record is not None and record.unit else name


def _goal(study: Study) -> tuple[str, float]:
    """Return what counts, the objective of a search or the first measure; and 1.0 where more is worse, else -1.0."""
    search = study.record.search
    if search is None:
        return next(iter(study.record.measure), ""), 1.0
    return str(search.minimize or search.maximize), 1.0 if search.minimize else -1.0


def _best(folder: StudyFolder, rows: Sequence[Row]) -> Iterator[str]:
    """Yield the best run of a search, with its values as YAML, and the objective over the trials."""
    study = folder.study
    goal, sign = _goal(study)
    values = sign * _of_good(rows, goal)
    if study.record.search is None or not np.isfinite(values).any():
        return
    row = rows[int(np.nanargmin(values))]
    yield f"<h2>Best run</h2>{_run(folder, row)}"
    paths = {name: study.path(name) for name in study.names}
    for first, place in ((True, "main configuration"), (False, "file of the study")):
        tree: dict[tuple[Key, ...], Any] = {
            (*ROOT, *path[1:]) if first else path: row[name]
            for name, path in paths.items()
            if (path[0] == CONFIGURATION_KEY) == first
        }
        if tree:
            yield f"<p>Values for the {place}:</p><pre>{html.escape(edited('', study.file, tree))}</pre>"
    figure = new_figure(7.2, 2.4)
    axes = figure.add_subplot()
    trials = numbers(rows, "run")
    axes.plot(trials, sign * values, ".", color=FIRST_COLOR, label="trial")
    best = np.fmin.accumulate(values)
    axes.step(trials, sign * best, where="post", color=SECOND_COLOR, label="best so far")
    axes.set_xlabel("trial")
    axes.set_ylabel(_label(study, goal))
    axes.legend()
    yield _picture(figure, f"{goal} over the trials")


def _summary(study: Study, rows: Sequence[Row]) -> str:
    """Return the table of mean, deviation and quantiles of each measure, of the runs that did not fail."""
    heads = ("measure", "runs", "mean", "deviation", "minimum", "median", "95 %", "maximum")
    lines = []
    for name in study.record.measure:
        values = _of_good(rows, name)
        values = values[np.isfinite(values)]
        if len(values):
            figures = (values.mean(), values.std(), *np.quantile(values, (0.0, 0.5, 0.95, 1.0)))
            lines.append([_label(study, name), str(len(values)), *(f"{each:.4g}" for each in figures)])
    return f"<h2>Measures</h2><div class=rows>{_html_table(heads, lines)}</div>"


def _histogram(study: Study, rows: Sequence[Row], name: str) -> str:
    """Draw the distribution of a measure, of runs that failed in another colour."""
    values = numbers(rows, name)
    failed = np.array([bool(row["failed"]) for row in rows])
    counts = np.isfinite(values)
    if not counts.any():
        return ""
    figure = new_figure(3.4, 2.2)
    axes = figure.add_subplot()
    parts = [values[counts & ~failed], values[counts & failed]]
    axes.hist(parts, bins=30, stacked=True, color=[FIRST_COLOR, WRONG_COLOR], label=["done", "failed"])
    axes.set_xlabel(_label(study, name))
    axes.set_ylabel("runs")
    if failed.any():
        axes.legend()
    return _picture(figure, f"distribution of {name}")


def _importance(rows: Sequence[Row], names: Sequence[str], measures: Sequence[str]) -> str:
    """Return the table of Spearman's rank correlations between variables and measures, the largest first."""
    lines = []
    for name, measure in itertools.product(names, ("failed", *measures)):
        correlation = rank_correlation(numbers(rows, name), _of_good(rows, measure))
        if math.isfinite(correlation):
            lines.append((abs(correlation), [measure, name, f"{correlation:+.2f}"]))
    if not lines:
        return ""
    table = _html_table(("measure", "variable", "correlation"), [line for _, line in sorted(lines, reverse=True)])
    rule = (
        "<p>Rank correlation: 1 or -1 where a measure only rises or falls with a variable, about 0 where neither.</p>"
    )
    return f"<h2>Importance</h2>{rule}{table}"


def rank_correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Return Spearman's rank correlation of two columns, shape (n,); NaN where one of them does not vary."""
    counts = np.isfinite(one) & np.isfinite(other)
    ranks = [rankdata(values[counts]) for values in (one, other)]
    if counts.sum() < 3 or min(float(np.ptp(each)) for each in ranks) == 0.0:
        return math.nan
    return float(np.corrcoef(*ranks)[0, 1])


def _scatter_plots(study: Study, rows: Sequence[Row], varying: Sequence[str]) -> Iterator[str]:
    """Draw each measure over each variable that is drawn; those of grids are in the maps."""
    drawn = [name for name in varying if study.variations[name].kind in ("uniform", "log_uniform", "normal")]
    failed = np.array([bool(row["failed"]) for row in rows])
    for measure, name in itertools.product(study.record.measure, drawn[:6]):  # more would bury the page
        figure = new_figure(3.4, 2.2)
        axes = figure.add_subplot()
        for chosen, color in ((~failed, FIRST_COLOR), (failed, WRONG_COLOR)):
            axes.plot(numbers(rows, name)[chosen], numbers(rows, measure)[chosen], ".", color=color, markersize=3)
        if study.variations[name].log_uniform is not None:
            axes.set_xscale("log")
            locator: Any = axes.xaxis.get_major_locator()
            locator.set_params(subs=(1.0, 2.0, 5.0))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter("")
        axes.set_xlabel(_label(study, name))
        axes.set_ylabel(_label(study, measure))
        yield _picture(figure, f"{measure} over {name}, one point for each run")


def _maps(study: Study, rows: Sequence[Row], varying: Sequence[str]) -> Iterator[str]:
    """Draw each measure, and the fraction of runs that failed, over each two variables."""
    pairs = list(itertools.combinations(varying, 2))[:6]  # more would bury the page
    failed = ["failed"] if any(row["failed"] for row in rows) else []
    for measure in (*failed, *study.record.measure):
        for first, second in pairs:
            yield _picture(
                _map(study, rows, first, second=second, measure=measure), f"{measure} over {first}, {second}"
            )


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
    save([(measure, _map(folder.study, rows, first, second=second, measure=measure))], out)


def _of_good(rows: Sequence[Row], measure: str) -> np.ndarray:
    """Return a measure of the runs that did not fail, NaN for the others, shape (n,); of `failed` all."""
    values = numbers(rows, measure)
    return values if measure == "failed" else np.where(numbers(rows, "failed") > 0, np.nan, values)


def _map(study: Study, rows: Sequence[Row], first: str, second: str, measure: str) -> "Figure":
    """Draw the mean of a measure over two variables."""
    (across, across_names), (up, up_names) = _levels(study, rows, first), _levels(study, rows, second)
    values = _of_good(rows, measure)
    shape = (len(up_names), len(across_names))
    finite = np.isfinite(values)
    place = np.ravel_multi_index((up[finite], across[finite]), shape)
    with np.errstate(invalid="ignore"):  # NaN where there is no run
        mean = np.bincount(place, values[finite], math.prod(shape)) / np.bincount(place, minlength=math.prod(shape))
    figure = new_figure(3.6, 2.6)
    axes = figure.add_subplot()
    image = axes.imshow(mean.reshape(shape), origin="lower", aspect="auto", cmap="viridis")
    axes.set_xticks(range(len(across_names)), across_names, rotation=45)
    axes.set_yticks(range(len(up_names)), up_names)
    axes.set_xlabel(_label(study, first))
    axes.set_ylabel(_label(study, second))
    figure.colorbar(image, label="fraction that failed" if measure == "failed" else _label(study, measure))
    return figure


def _levels(study: Study, rows: Sequence[Row], name: str) -> tuple[np.ndarray, list[str]]:
    """Return the level of a variable in each row, shape (n,), and the names of the levels."""
    values = numbers(rows, name)
    distinct = {str(row.get(name)): row.get(name) for row in rows}
    distinct = dict(sorted(distinct.items(), key=lambda item: (_number(item[1]), item[0])))
    most = 12
    if len(distinct) <= most or not np.isfinite(values).all():
        place = {text: index for index, text in enumerate(distinct)}
        return np.array([place[str(row.get(name))] for row in rows]), [shown(value) for value in distinct.values()]
    count = min(most, max(3, math.isqrt(len(rows)) // 2))  # so that most pieces of the range have runs
    spaced = np.linspace if study.variations[name].log_uniform is None else np.geomspace
    edges = spaced(values.min(), values.max(), count + 1)
    middles = spaced(values.min(), values.max(), 2 * count + 1)[1::2]
    return np.clip(np.digitize(values, edges) - 1, 0, count - 1), [f"{middle:.3g}" for middle in middles]


def _worst(folder: StudyFolder, rows: Sequence[Row]) -> str:
    """Return the runs that failed, and those with the worst of what counts, each with its plot and its command."""
    goal, sign = _goal(folder.study)
    size = np.nan_to_num(sign * numbers(rows, goal), nan=-math.inf)
    order = sorted(range(len(rows)), key=lambda place: (-rows[place]["failed"], -size[place]))
    return f"<h2>Worst runs</h2>{''.join(_run(folder, rows[place]) for place in order[:5])}"


def _run(folder: StudyFolder, row: Row) -> str:
    """Return a run: its numbers, why it failed, its command and its plot."""
    study = folder.study
    figures = ", ".join(
        f"{_label(study, name)} {shown(row.get(name))}" for name in (*study.names, *study.record.measure)
    )
    reason = f"<br>failed: {html.escape(row['failure'])}" if row["failed"] else ""
    text = f"{html.escape(figures)}{reason}<br><code>{html.escape(_command(folder, row))}</code>"
    return f"<h3>run {row['run']}</h3><p>{text}</p>{_plot(folder, row['id'])}"


def _command(folder: StudyFolder, row: Row) -> str:
    """Return what repeats a run."""
    return f"solfer study {shlex.quote(folder.study.file)} --out {shlex.quote(str(folder.path))} --rerun {row['id']}"


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
    return _picture(figure, f"columns of run {run_id} over time") + recorded


def _table(folder: StudyFolder, rows: Sequence[Row]) -> str:
    heads = list(rows[0])
    most = 2000
    lines = [[*(shown(row.get(name)) for name in heads), _command(folder, row)] for row in rows[:most]]
    marks = ["failed" if row["failed"] else "" for row in rows[:most]]
    more = f"<p>{len(rows) - most} more are in <code>table.csv</code>.</p>" if len(rows) > most else ""
    names = [*(_label(folder.study, head) for head in heads), "command"]
    return f"<h2>Runs</h2><div class=rows>{_html_table(names, lines, marks)}</div>{more}"


def _html_table(heads: Sequence[str], lines: Sequence[Sequence[str]], marks: Sequence[str] = ()) -> str:
    top = "".join(f"<th>{html.escape(head)}</th>" for head in heads)
    body = "".join(
        f"<tr class={marks[place] if marks and marks[place] else 'run'}>"
        + "".join(f"<td>{html.escape(cell)}</td>" for cell in line)
        + "</tr>"
        for place, line in enumerate(lines)
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def _section(title: str, pictures: Iterable[str]) -> str:
    text = "".join(pictures)
    return f"<h2>{title}</h2><div class=pictures>{text}</div>" if text else ""


def _picture(figure: "Figure", alternative: str) -> str:
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=90)
    data = base64.b64encode(content.getvalue()).decode()
    return f'<img alt="{html.escape(alternative)}" src="data:image/png;base64,{data}">'

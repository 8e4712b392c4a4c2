"""The page of a study: what it says about a search, and how it cuts and correlates what was drawn."""

import html
import re
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from scipy.stats import spearmanr
from support.unit.studies import made

from solfer_tools.study import Result
from solfer_tools.study.folder import StudyFolder
from solfer_tools.study.report import _levels, rank_correlation, write_report

MOTION = "configuration/modules/wheeled_motion"
PARAMETERS = {
    "gain": {"path": f"{MOTION}/tunnings/disturb/CAMBER", "log_uniform": [0.1, 4.0]},
    "rest": {"path": f"{MOTION}/rest", "choice": [True, False]},
    "mass": {"path": "simulation/mass", "uniform": [0.9, 1.1], "unit": "-"},
}
TRIALS = (
    ({"gain": 3.0, "rest": False, "mass": 1.0}, 0.5),
    ({"gain": 0.2, "rest": True, "mass": 0.95}, 0.123456789),
    ({"gain": 0.7, "rest": False, "mass": 1.05}, 0.3),
    ({"gain": 0.1, "rest": True, "mass": 1.1}, None),
)
"""Values of each trial, and the measure; none: it failed."""


@pytest.mark.slow
def test_the_page_of_a_search_begins_with_its_best_run(tmp_path):
    measure = {"tilt": {"columns": "simulation/base/tilt", "reduce": "max", "unit": "rad"}}
    search = {"minimize": "tilt", "trials": 4, "parameters": PARAMETERS}
    study = made(tmp_path, search=search, measure=measure, description="gains <b>&</b>")
    folder = StudyFolder.create(tmp_path / "out", study, study.empty_plan())
    for index, (values, tilt) in enumerate(TRIALS):
        folder.add(folder.study.planned(index, 0, values))
        folder.finish(folder.runs[index], Result("", {"tilt": tilt}) if tilt else Result("fell <i>", {"tilt": 0.01}))
    page = write_report(folder).read_text()
    heads = re.findall(r"<h2>(.*?)</h2>", page)
    assert heads == [
        "Best run", "Measures", "Distributions", "Importance", "Measures by variables", "Maps", "Worst runs", "Runs"
    ]  # fmt: skip
    assert "gain 0.2, rest true, mass [-] 0.95, tilt [rad] 0.12346" in page and "0.123456789" not in page
    tags, ours = (yaml.safe_load(html.unescape(text)) for text in re.findall(r"<pre>(.*?)</pre>", page, re.DOTALL))
    assert tags["mwoibn"]["modules"] == {"wheeled_motion": {"tunnings": {"disturb": {"CAMBER": 0.2}}, "rest": True}}
    assert ours == {"simulation": {"mass": 0.95}}
    assert "<html lang=en>" in page and "name=viewport" in page and "<b>" not in page and "<i>" not in page
    assert all(
        page.count(f"<td>solfer study {study.file} --out {folder.path} --rerun {run.id}<") for run in folder.runs
    )
    pictures = re.findall(r"<img [^>]*>", page)
    assert len(pictures) > 5 and all(re.match(r'<img alt="[^"]+" src', picture) for picture in pictures)
    (line,) = re.findall(r"<td>tilt</td><td>gain</td><td>(.*?)</td>", page)
    assert line == "+1.00"


def test_the_rank_correlation_is_that_of_scipy():
    draw = np.random.default_rng(0)
    one = draw.integers(0, 5, 40).astype(float)  # with equal values
    other = np.exp(one) + draw.normal(size=40)
    expected = spearmanr(one, other).statistic
    assert rank_correlation(np.append(one, np.nan), np.append(other, 1.0)) == pytest.approx(expected)
    assert np.isnan(rank_correlation(one, np.ones(40)))


@pytest.mark.parametrize(
    ("kind", "middles"), [("uniform", ["17.5", "50.5", "83.5"]), ("log_uniform", ["2.15", "10", "46.4"])]
)
def test_a_range_is_cut_as_it_was_drawn(kind, middles):
    record = SimpleNamespace(log_uniform=(1.0, 100.0) if kind == "log_uniform" else None)
    rows = [{"gain": value} for value in np.geomspace(1.0, 100.0, 36)]
    levels, names = _levels(SimpleNamespace(variations={"gain": record}), rows, "gain")
    counts = np.bincount(levels)
    assert [float(name) for name in names] == pytest.approx([float(middle) for middle in middles], rel=0.005)
    assert (counts == 12).all() == (kind == "log_uniform")

"""Columns of a run, and the numbers that are made of them."""

import math

import numpy as np
import pytest

from solfer.errors import ConfigError, UnknownName
from solfer.recording.log import Logger
from solfer_tools.study.measures import Columns, evaluated, measured
from solfer_tools.study.records import MeasureRecord

RAMP = np.arange(3000) * 0.01


@pytest.fixture
def columns():
    """Two columns over time: x, a sine, and y, a cosine."""
    log = Logger("robot")
    place, count, timing = np.zeros(2), np.zeros(1, dtype=np.int64), np.zeros(1)
    log.add("place", place, ("x", "y"))
    log.add("count", count, ("n",), factor=0.5)
    log.add("timing", timing, ("cost",))
    found = Columns(log.sources, ["robot/place/x", "robot/place/y", "robot/count/n"], lambda name: "study.yaml:1:1")
    for step, time in enumerate(RAMP):
        place[:] = math.sin(time), math.cos(time)
        count[0] = step
        found.sample(time)
    return found


def number(kept, **tags):
    return measured({"it": MeasureRecord(**tags)}, kept, {})["it"]


def test_columns_are_kept_with_their_units(columns):
    np.testing.assert_allclose(columns["robot/place/x"], np.sin(RAMP))
    np.testing.assert_allclose(columns["robot/count/n"], 0.5 * np.arange(3000))
    np.testing.assert_allclose(columns.times, RAMP)


@pytest.mark.parametrize(
    ("reduce", "expected"),
    [
        ("rms", np.sqrt(np.mean(np.sin(RAMP) ** 2))),
        ("max", np.sin(RAMP).max()),
        ("min", np.sin(RAMP).min()),
        ("mean", np.sin(RAMP).mean()),
        ("std", np.sin(RAMP).std()),
        ("begin", 0.0),
        ("end", np.sin(RAMP[-1])),
        ("change", np.sin(RAMP[-1])),
    ],
)
def test_reductions(columns, reduce, expected):
    assert number(columns, columns="robot/place/x", reduce=reduce) == pytest.approx(expected)


def test_several_columns_count_by_their_norm_and_others_are_subtracted(columns):
    both = ("robot/place/x", "robot/place/y")
    assert number(columns, columns=both, reduce="max") == pytest.approx(1.0)
    assert number(columns, columns=both, minus=both[::-1], reduce="max") == pytest.approx(2.0, abs=1e-4)


def test_a_part_of_the_time_counts(columns):
    kept = RAMP[(RAMP >= 1.0) & (RAMP <= 2.0)]
    found = number(columns, columns="robot/place/y", reduce="mean", since=1.0, until=2.0)
    assert found == pytest.approx(np.cos(kept).mean())
    assert math.isnan(number(columns, columns="robot/place/y", since=99.0))


def test_an_expression_has_measures_and_variations(columns):
    measures = {
        "top": MeasureRecord(columns="robot/place/x", reduce="max"),
        "share": MeasureRecord(derive="sqrt(top) / friction"),
        "nothing": MeasureRecord(derive="top / (friction - 0.5)"),
    }
    found = measured(measures, columns, {"friction": 0.5})
    assert found["share"] == pytest.approx(2.0 * math.sqrt(found["top"]))
    assert math.isnan(found["nothing"])


@pytest.mark.parametrize("text", ["__import__('os')", "top.__class__", "open('x')", "top +", "'a' * 10**9"])
def test_an_expression_reaches_nothing_else(text):
    with pytest.raises(ConfigError, match="cannot be computed"):
        evaluated(text, {"top": 1.0}, "study.yaml:1:1")


def test_unknown_columns_and_those_of_the_machine_are_errors():
    log = Logger("robot")
    log.add("timing", np.zeros(1), ("cost",))
    with pytest.raises(UnknownName, match="did you mean: robot/timing/cost"):
        Columns(log.sources, ["robot/timing/cst"], lambda name: "study.yaml:3:1")
    with pytest.raises(ConfigError, match="differs from machine to machine"):
        Columns(log.sources, ["robot/timing/cost"], lambda name: "study.yaml:3:1")

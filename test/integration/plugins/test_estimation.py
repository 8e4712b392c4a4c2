"""Estimators beside a robot that drives on sensors which err; longer: benchmark/estimation.py."""

import importlib.util
from contextlib import closing
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


def load():
    """Load benchmark/estimation.py."""
    spec = importlib.util.spec_from_file_location("benchmark_estimation", ROOT / "benchmark/estimation.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


benchmark = load()


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """Return the figures of all methods after a metre, and the estimators."""
    with closing(benchmark.Course(3, 1.0, None, tmp_path_factory.mktemp("course"))) as course:
        course.drive(benchmark.SPEED, 0.0, 0.0, 2.5)
        made = {name: benchmark.figures(course, index, name) for index, name in enumerate(benchmark.METHODS, 1)}
        yield made, course


@pytest.mark.parametrize("method", benchmark.METHODS)
def test_the_base_is_where_wheels_have_carried_it(driven, method):
    figures, _ = driven
    assert 0.6 < figures[method]["length"] < 0.9
    assert figures[method]["end_error"] < 0.015 and figures[method]["height_error"] < 0.01


def test_the_heading_of_the_filter_does_not_drift(driven):
    figures, course = driven
    assert figures["filter"]["heading_error"] < 0.2
    assert abs(course.estimators["filter"].component.law.kalman.bias) > 1e-4  # the gyroscope's, which is drawn


def test_forces_carry_the_weight(driven):
    figures, _ = driven
    assert figures["filter"]["force_error"] < 0.05 and figures["filter"]["contact_right"] > 0.98


def test_nothing_listens_to_the_simulators_truth(driven):
    _, course = driven
    sources = {pipe.reader.topic for plugin in course.estimators.values() for pipe in plugin.feedbacks}
    assert sources == {"joint_states", "imu"}

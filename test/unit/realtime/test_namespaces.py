"""Namespaces by name, and the layers that live in them."""

import os
import time

import pytest

from solfer.errors import MiddlewareError, UnknownName
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.namespaces import cure, find, living, no_layer
from solfer.segments.namespace import Namespace
from solfer.telemetry.statistics import RuntimeStatistics


@pytest.fixture
def layers(tmp_path):
    """Make three namespaces; layers run in the last two."""
    Namespace("centaur", tmp_path)
    made = [
        RuntimeStatistics.create(Namespace(name, tmp_path).folder, 100.0, ["arm"], ["a"]) for name in ("one", "two")
    ]
    yield tmp_path
    for each in made:
        each.close()


def test_namespaces_are_found_by_name(layers):
    assert find("centaur", layers).folder == layers / "solfer-centaur"
    assert living(layers) == ["one", "two"]
    with pytest.raises(UnknownName) as unknown:
        find("centaru", layers)
    assert unknown.value.what == "unknown namespace 'centaru'" and unknown.value.where == str(layers)
    assert unknown.value.expected == "--namespace of an RT layer that lives: one, two"
    assert unknown.value.names == ("centaur",)
    assert not (layers / "solfer-centaru").exists()


def test_a_namespace_without_layer_names_others(layers, tmp_path_factory):
    error = no_layer(Namespace("tw", layers))
    assert str(error) == (
        f"{layers / 'solfer-tw'}: no RT layer lives in the namespace 'tw'\n"
        "  expected: --namespace of an RT layer that lives: one, two\n  did you mean: two?"
    )
    assert cure(tmp_path_factory.mktemp("empty")) == "an RT layer that lives"


def test_statistics_without_a_layer_are_refused(tmp_path):
    with pytest.raises(MiddlewareError, match="no RT layer to look at: shared memory cannot be opened") as missing:
        RuntimeStatistics.attach(tmp_path)
    assert missing.value.where == str(tmp_path / "statistics")
    assert missing.value.expected == "`rosrun solfer xbot`, and its namespace"


def test_the_first_reason_of_a_stop_stays(tmp_path):
    """A later trip must not hide the cause; long reasons are cut, and the latch outlives its processes."""
    mine, other = EmergencyStopLatch(tmp_path), EmergencyStopLatch(tmp_path)
    assert not mine and mine.reason == "" and mine.answered == 0
    before = time.monotonic_ns()
    other.trip("x" * (EmergencyStopLatch.TEXT_SIZE + 1))
    mine.trip("later")
    assert mine and mine.reason == f"{'x' * EmergencyStopLatch.TEXT_SIZE} (process {os.getpid()})"
    assert before <= mine.time <= time.monotonic_ns() and mine.answered == 0
    mine.answer("legs at rest")
    assert mine.time <= other.answered <= time.monotonic_ns()
    mine.clear()
    assert not other and other.reason == ""
    other.trip("short")
    other.close()
    assert mine.reason == f"short (process {os.getpid()})"
    mine.close()
    assert EmergencyStopLatch(tmp_path).reason.startswith("short")


def test_a_reason_is_cut_between_any_bytes(tmp_path):
    latch = EmergencyStopLatch(tmp_path)
    latch.trip(f"x{'é' * EmergencyStopLatch.TEXT_SIZE}")  # the cut goes through a letter of two bytes
    assert latch.reason == f"x{'é' * (EmergencyStopLatch.TEXT_SIZE // 2 - 1)}\ufffd (process {os.getpid()})"
    latch.clear()
    latch.trip("\udcff")  # no letter at all, as of a file's name
    assert latch.reason == f"? (process {os.getpid()})"

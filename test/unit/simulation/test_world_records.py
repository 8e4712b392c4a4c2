"""Files of worlds: what ships, and mistakes with their place."""

from pathlib import Path

import pytest

from solfer.errors import SolferError, UnknownName
from solfer.simulation.world.records import StairsRecord
from solfer.simulation.world.world import read_world, steps_of

WORLDS = Path(__file__).resolve().parents[3] / "config/worlds"


def test_the_shipped_worlds_are_as_they_are_called():
    worlds = {path.stem: read_world(path) for path in WORLDS.glob("*.yaml")}
    assert set(worlds) == {"flat", "slope", "steps", "boxes", "ice", "gate", "ridge"}
    assert worlds["flat"].ground.slope == 0.0 and not worlds["flat"].boxes
    assert worlds["slope"].ground.slope == pytest.approx(5.0 * 3.14159265 / 180.0)
    assert worlds["steps"].stairs["front"].count == 4
    assert {box.mass is None for box in worlds["boxes"].boxes.values()} == {True, False}


def test_steps_rise_along_their_yaw():
    stairs = StairsRecord(position=(1.0, 2.0), yaw=3.14159265 / 2.0, count=3, rise=0.1, tread=0.3, width=1.0)
    low, _, high = steps_of(stairs)
    assert low.size == pytest.approx((0.9, 1.0, 0.1)) and high.size == pytest.approx((0.3, 1.0, 0.3))
    assert low.position == pytest.approx((1.0, 2.45, 0.05))
    assert high.position == pytest.approx((1.0, 2.75, 0.15))


@pytest.mark.parametrize(
    ("text", "place", "error"),
    [
        ("ground: {slop: 0.1}\n", "1:10", "slope"),
        ("ground: {slope: .nan}\n", "1:17", "finite"),
        ("ground: {slope: 2.0}\n", "1:17", "at most 1"),
        ("boxes:\n  crate: {size: [1, 1], position: [0, 0, 0]}\n", "2:17", "list"),
        ("boxes:\n  crate: {size: [1, 1, 0], position: [0, 0, 0]}\n", "2:24", "at least 0.0001"),
        ("boxes:\n  crate: {size: [1, 1, 1], position: [0, 0, 0], mass: -2}\n", "2:55", "at least 0.001"),
        ("boxes:\n  ground: {size: [1, 1, 1], position: [0, 0, 0]}\n", "", "used twice"),
    ],
)
def test_a_mistake_has_its_place(tmp_path, text, place, error):
    file = tmp_path / "world.yaml"
    file.write_text(text)
    with pytest.raises(SolferError) as caught:
        read_world(file)
    assert f"world.yaml:{place}" in str(caught.value)
    assert error in str(caught.value)


def test_an_unknown_key_names_the_nearest(tmp_path):
    file = tmp_path / "world.yaml"
    file.write_text("boxs: {}\n")
    with pytest.raises(UnknownName) as caught:
        read_world(file)
    assert caught.value.names == ("boxes",)

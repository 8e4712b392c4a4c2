"""Files of worlds: what ships, and mistakes with their place."""

from pathlib import Path

import numpy as np
import pytest

from solfer.errors import SolferError, UnknownName
from solfer.simulation.world.grids import Grid, steepest
from solfer.simulation.world.records import GridRecord, StairsRecord, UnevenRecord
from solfer.simulation.world.world import read_world, steps_of

WORLDS = Path(__file__).resolve().parents[3] / "config/worlds"


def test_the_shipped_worlds_are_as_they_are_called():
    worlds = {path.stem: read_world(path) for path in WORLDS.glob("*.yaml")}
    assert set(worlds) == {"flat", "slope", "steps", "boxes", "ice", "gate", "ridge", "ramp", "step", "uneven", "wall"}
    assert worlds["flat"].ground.slope == 0.0 and not worlds["flat"].boxes
    assert worlds["slope"].ground.slope == pytest.approx(5.0 * 3.14159265 / 180.0)
    assert worlds["ramp"].boxes["up"].rpy[1] == pytest.approx(-15.0 * 3.14159265 / 180.0)
    assert worlds["steps"].stairs["front"].count == 4
    assert not worlds["uneven"].ground.exists
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
        ("grids:\n  hill: {spacing: 0.1, heights: [[0, .nan], [0, 0]]}\n", "2:38", "finite"),
        ("grids:\n  hill: {spacing: 0.1, heights: [[0, 0], [0, 0, 0]]}\n", "2:42", "row 2 has 3 heights"),
        ("grids:\n  hill: {spacing: 0.1, heights: [[0, 0]]}\n", "2:33", "at least 2"),
        ("grids:\n  hill: {spacing: 0.1, heights: [[0, high], [0, 0]]}\n", "2:38", "a number"),
        ("grids:\n  hill: {spacing: 0.1}\n", "2:9", "got none"),
        ("grids:\n  hill: {spacing: 0.1, file: hil.npy}\n", "2:30", "there is no file"),
        ("grids:\n  hill: {spacing: 0.1, file: world.yaml}\n", "2:30", "numpy.save"),
        ("grids:\n  hill: {spacing: 0.1, file: cube.npy}\n", "2:30", "(2, 2, 2)"),
        ("grids:\n  hill: {spacing: 0.1, file: infinite.npy}\n", "2:30", "[1, 0]"),
        ("grids:\n  hill: {spacing: 0.1, file: words.npy}\n", "2:30", "numbers"),
        ("grids:\n  hill: {spacing: 0.001, uneven: {size: [9, 1], height: 1, length: 1}}\n", "2:41", "9001 x 1001"),
    ],
)
def test_a_mistake_has_its_place(tmp_path, text, place, error):
    arrays = {"cube": np.zeros((2, 2, 2)), "infinite": [[0.0, 0.0], [np.inf, 0.0]], "words": [["a", "b"]] * 2}
    for name, array in arrays.items():
        np.save(tmp_path / name, array)
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


def test_heights_come_from_a_file_beside_the_world(tmp_path):
    np.save(tmp_path / "hill", np.arange(6.0).reshape(3, 2))
    file = tmp_path / "world.yaml"
    file.write_text("grids: {hill: {spacing: 0.5, file: hill.npy}}\n")
    np.testing.assert_array_equal(Grid(read_world(file).grids["hill"]).heights, [[0, 1], [2, 3], [4, 5]])


@pytest.mark.parametrize(("height", "length"), [(0.1, 0.5), (0.3, 3.0)])
def test_uneven_ground_keeps_its_height_and_slope(height, length):
    def heights(seed):
        uneven = UnevenRecord(size=(4.0, 3.0), height=height, length=length, seed=seed)
        return Grid(GridRecord(spacing=0.05, uneven=uneven)).heights

    first = heights(3)
    assert first.shape == (81, 61) and first.min() == 0.0
    fractions = first.max() / height, steepest(first, 0.05) * length / height
    assert max(fractions) == pytest.approx(1.0) and min(fractions) > 0.3
    np.testing.assert_array_equal(first, heights(3))
    assert np.abs(first - heights(4)).max() > 0.1 * height


def test_the_top_of_a_grid_is_that_below_a_box():
    heights = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 2.0))
    grid = Grid(GridRecord(spacing=1.0, heights=heights, position=(10.0, 0.0, 0.5), yaw=np.pi / 2.0))
    for x, y, top in ((9.5, 0.5, 2.5), (10.5, 0.5, 0.5), (9.5, -0.5, 0.5), (12.0, 0.0, None)):
        assert grid.top(np.array([x - 0.1, y - 0.1, 0.0]), np.array([x + 0.1, y + 0.1, 1.0])) == top

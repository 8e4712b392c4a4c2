"""Maps between DoFs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from solfer.errors import ModelError, SizeMismatch, UnknownName
from solfer.model import BidirectionalMap, Maps, UnidirectionalMap

ROBOT = ("hip", "knee", "ankle", "wheel")


@pytest.fixture
def mapping():
    return BidirectionalMap("PYTHON", ROBOT, ("camera", "wheel", "hip", "ankle"))


def test_matched_pairs_stand_in_outside_order(mapping):
    assert_array_equal(mapping.robot_indices, (3, 0, 2))
    assert_array_equal(mapping.external_indices, (1, 2, 3))
    assert (mapping.size, mapping.robot_size) == (4, 4)


def test_what_is_not_mapped_stays_as_it_was(mapping):
    assert_array_equal(mapping.to_external(np.array((1.0, 2.0, 3.0, 4.0)), np.full(4, -1.0)), (-1, 4, 1, 3))
    assert_array_equal(mapping.to_robot(np.array((9.0, 4.0, 1.0, 3.0)), np.full(4, -1.0)), (1, -1, 3, 4))


def test_maps_write_in_place(mapping):
    out = np.zeros(4)
    assert mapping.to_external(np.arange(4.0), out) is out


@given(st.permutations(ROBOT), st.lists(st.sampled_from(ROBOT), unique=True))
def test_there_and_back_gives_the_mapped_dofs(order, members):
    mapping = BidirectionalMap("any", order, members)
    values = np.arange(1.0, 5.0)
    back = mapping.to_robot(mapping.to_external(values, np.zeros(len(members))), np.zeros(4))
    assert_array_equal(back, [value if name in members else 0.0 for name, value in zip(order, values, strict=True)])


def test_selection_keeps_the_outside_order(mapping):
    some = mapping.select(np.array((0, 1, 3)), "leg")
    assert (some.name, some.external) == ("leg", ("wheel", "hip"))
    assert_array_equal(some.robot_indices, (3, 0))
    assert_array_equal(some.external_indices, (0, 1))
    assert mapping.select(()).size == 0


@pytest.mark.parametrize("robot, outside", [(("a", "a"), ("a",)), (("a", "b"), ("b", "b"))])
def test_names_that_stand_twice_are_refused(robot, outside):
    with pytest.raises(ModelError, match="stand twice among the .*: [ab]"):
        BidirectionalMap("twice", robot, outside)


def test_selector_keeps_the_order_of_its_members():
    selector = UnidirectionalMap("end", ROBOT, ("wheel", "knee"))
    assert_array_equal(selector.indices, (3, 1))
    assert_array_equal(selector.mask, (False, True, False, True))
    assert_array_equal(selector.read(np.arange(4.0), np.zeros(2)), (3, 1))
    assert_array_equal(selector.write(np.array((7.0, 8.0)), np.zeros(4)), (0, 8, 0, 7))
    assert UnidirectionalMap("none", ROBOT, ()).size == 0


def test_selector_of_an_unknown_dof_offers_the_nearest():
    with pytest.raises(UnknownName, match="unknown DoF 'kne'") as caught:
        UnidirectionalMap("leg", ROBOT, ("kne",))
    assert caught.value.names[0] == "knee"
    with pytest.raises(ModelError, match="stand twice"):
        UnidirectionalMap("leg", ROBOT, ("knee", "knee"))


def test_maps_are_added_online_and_found_by_name(mapping):
    maps = Maps("map", ROBOT)
    maps.add(mapping)
    maps.add(mapping, "alias")
    assert maps["PYTHON"] is maps["alias"] is mapping
    assert list(maps) == ["PYTHON", "alias"] and len(maps) == 2 and "PYTHON" in maps and "RBDL" not in maps
    with pytest.raises(UnknownName, match="unknown map 'python2'") as caught:
        maps.get("python2", where="file.yaml:3:4")
    assert caught.value.names == ("PYTHON",) and caught.value.where == "file.yaml:3:4"


def test_maps_that_do_not_fit_are_refused(mapping):
    maps = Maps("map", ROBOT)
    maps.add(mapping)
    with pytest.raises(ModelError, match="a map 'PYTHON' already"):
        maps.add(mapping)
    with pytest.raises(SizeMismatch, match="made for 2 DoFs, the robot has 4"):
        maps.add(BidirectionalMap("small", ROBOT[:2], ROBOT))
    with pytest.raises(ModelError, match="other DoFs"):
        maps.add(BidirectionalMap("reversed", ROBOT[::-1], ROBOT))

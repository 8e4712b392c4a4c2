"""The State: live arrays, interfaces and versions."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from solfer.errors import ModelError, SizeMismatch, UnknownName
from solfer.model import State


@pytest.fixture
def state():
    return State(("hip", "knee", "wheel"))


def test_default_interfaces_are_zero(state):
    assert state.interfaces == ("position", "velocity", "acceleration", "torque")
    for name in state.interfaces:
        assert_array_equal(state[name], np.zeros(3))


def test_arrays_are_live_and_assignment_copies(state):
    position, source = state.position, np.array((1.0, 2.0, 3.0))
    state.position = source
    source[0] = 9.0
    assert state.position is position is state["position"]
    assert_array_equal(position, (1, 2, 3))
    state.position[1] = 5.0
    assert_array_equal(state["position"], (1, 5, 3))


def test_versions_move_only_when_data_changes(state):
    assert state.write("velocity", np.array((1.0, 0.0, 0.0)))
    assert not state.write("velocity", np.array((1.0, 0.0, 0.0)))
    assert (state.version("velocity"), state.version("position")) == (1, 0)
    assert state.write("velocity", np.array((2.0, 3.0)), np.array((2, 1)))
    assert_array_equal(state.velocity, (1, 3, 2))
    assert not state.write("velocity", np.array((2.0, 3.0)), np.array((2, 1)))
    assert state.version("velocity") == 2
    state.velocity[0] = 8.0
    state.touch("velocity")
    assert state.version("velocity") == 3


def test_interfaces_are_added_online(state):
    stiffness = state.add("stiffness")
    assert state.add("wrench", 6).shape == (6,)
    assert "stiffness" in state and "stifness" not in state
    state["stiffness"] = np.ones(3)
    assert_array_equal(stiffness, np.ones(3))
    for size in (-1, 2.5):
        with pytest.raises(SizeMismatch, match=f"'damping' of {size} numbers"):
            state.add("damping", size)
    assert "damping" not in state
    with pytest.raises(ModelError, match="interface 'stiffness' already"):
        state.add("stiffness")


@pytest.mark.parametrize(
    "access",
    [
        lambda state: state["positon"],
        lambda state: state.version("positon"),
        lambda state: state.touch("positon"),
        lambda state: state.write("positon", np.zeros(3)),
    ],
)
def test_unknown_interface_offers_the_nearest(state, access):
    with pytest.raises(UnknownName, match="unknown interface 'positon'") as caught:
        access(state)
    assert caught.value.names == ("position",)


@pytest.mark.parametrize("values", [np.zeros(2), np.zeros((3, 1)), 0.0])
def test_wrong_sizes_are_refused(state, values):
    with pytest.raises(SizeMismatch, match=r"has numbers of shape \(3,\), got shape"):
        state.torque = values
    with pytest.raises(SizeMismatch, match=r"has numbers of shape \(1,\), got shape"):
        state.write("torque", values, np.array([0]))

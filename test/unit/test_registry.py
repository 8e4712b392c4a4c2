"""Plugins are found by name or by class; what is not found is told with the nearest names."""

import pytest

from solfer.components.joint_states import JointStates
from solfer.errors import ComponentError, UnknownName
from solfer.plugins import Generator, Registry


class OwnGenerator(Generator):
    """A generator of its own, as a component with special communication has one."""

    component = JointStates


def test_a_plugin_is_known_by_its_name_and_describes_itself():
    registry = Registry()
    assert "joint_states" in registry.names()
    assert registry.find("joint_states").component is JointStates
    assert registry.describe("joint_states").endswith("by a service.")
    assert registry.configuration("joint_states") == "joint_states"


def test_a_class_goes_before_the_name_and_may_be_a_generator():
    registry = Registry()
    assert registry.find("mine", "solfer.components.joint_states:JointStates").component is JointStates
    assert registry.find("mine", f"{__name__}:OwnGenerator") is OwnGenerator


def test_a_configuration_with_its_own_name_is_a_plugin():
    assert Registry().configuration("nod") == "nod"
    Registry().require("nod", ("joint_states", "nod"))
    Registry().require("joint_states", ())
    with pytest.raises(UnknownName, match="unknown plugin 'nodd'") as caught:
        Registry().require("nodd", ("joint_states", "nod"))
    assert caught.value.names == ("nod",)


@pytest.mark.parametrize(
    ("target", "error", "text"),
    [
        ("solfer.components.joint_states", ComponentError, "names no class"),
        ("solfer.components.joint_stats:JointStates", ComponentError, "cannot be imported"),
        ("solfer.components.joint_states:JointState", UnknownName, "did you mean: JointStates"),
        ("solfer.errors:SolferError", ComponentError, "is no component"),
        ("solfer.components.move_joints:RESET", ComponentError, "is no component"),
    ],
)
def test_a_class_that_cannot_be_used_is_told_with_its_place(target, error, text):
    with pytest.raises(error) as caught:
        Registry().find("mine", target, "a.yaml:3:5")
    assert text in str(caught.value) and str(caught.value).startswith("a.yaml:3:5: ")


def test_an_unknown_name_without_a_class_is_told_with_the_nearest():
    with pytest.raises(UnknownName) as caught:
        Registry().find("joint_stats")
    assert caught.value.names == ("joint_states",)

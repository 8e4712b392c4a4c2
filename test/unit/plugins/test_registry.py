"""Plugins are found by name or by class; an error for an unknown one suggests the nearest names."""

import pytest

from solfer.components.joint_states import JointStates
from solfer.errors import ComponentError, UnknownName
from solfer.plugins import Generator, Registry


class OwnGenerator(Generator):
    """A generator of a component with special communication."""

    component = JointStates


def test_a_plugin_is_found_and_described_by_name():
    registry = Registry()
    assert "joint_states" in registry.names()
    assert registry.find("joint_states").component is JointStates
    assert registry.describe("joint_states").endswith("by a service.")
    assert registry.configuration("joint_states") == "joint_states"


def test_a_class_precedes_the_name():
    registry = Registry()
    assert registry.find("mine", "solfer.components.joint_states:JointStates").component is JointStates
    assert registry.find("mine", f"{__name__}:OwnGenerator") is OwnGenerator


def test_a_configuration_of_any_name_is_a_plugin():
    assert Registry().configuration("nod") == "nod"
    Registry().require("nod", ("joint_states", "nod"))
    Registry().require("joint_states", ())
    with pytest.raises(UnknownName, match="unknown plugin 'nodd'") as caught:
        Registry().require("nodd", ("joint_states", "nod"))
    assert caught.value.names == ("nod",)


@pytest.mark.parametrize(
    ("target", "error", "text"),
    [
        ("solfer.components.joint_states", ComponentError, "is not the name of a class"),
        (":Component", ComponentError, "is not the name of a class"),
        ("solfer.components:", ComponentError, "is not the name of a class"),
        ("solfer.components:No-Name", ComponentError, "is not the name of a class"),
        ("solfer.components.joint_stats:JointStates", ComponentError, "cannot be imported"),
        ("solfer.components.joint_states:JointState", UnknownName, "did you mean: JointStates"),
        ("solfer.errors:SolferError", ComponentError, "is not a component"),
        ("solfer.components.following.progress:CREEP_RATIO", ComponentError, "is not a component"),
    ],
)
def test_an_unusable_class_is_reported_with_its_place(target, error, text):
    with pytest.raises(error) as caught:
        Registry().find("mine", target, "a.yaml:3:5")
    assert text in str(caught.value) and str(caught.value).startswith("a.yaml:3:5: ")


def test_an_unknown_name_suggests_the_nearest():
    with pytest.raises(UnknownName) as caught:
        Registry().find("joint_stats")
    assert caught.value.names == ("joint_states",)

"""What plugins and their generation refuse, word for word."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.plugins.several import Several
from support.unit.joint_pipes import received

from solfer.components import Component
from solfer.config import load
from solfer.errors import SolferError
from solfer.interfaces.declaration import Service
from solfer.plugins.generation.dry_run import DryMiddleware
from solfer.plugins.generation.registry import load_class
from solfer.plugins.life.switchboard import find_conflicts
from solfer.plugins.outputs.outputs import _refuse
from solfer.plugins.sharing.groups import _two_sources
from solfer.plugins.sharing.space import SharedTopic, _rivals
from solfer.robot.description.shipped import robot_files
from solfer.telemetry.plugin_log import _declared


def refusal(call):
    with pytest.raises(SolferError) as error:
        call()
    return error.value.where, error.value.what, error.value.expected


def test_classes_that_cannot_be_loaded():
    """A malformed target, a function, a missing module and a missing class each get a text that helps."""
    assert load_class("solfer.components:Component") is Component
    names = "package.module:Class"
    for target in ("solfer.components", ":Component", "solfer.components:", "solfer.components:No-Name"):
        assert refusal(lambda target=target: load_class(target, "a.yaml:1:2")) == (
            "a.yaml:1:2",
            f"'{target}' is not the name of a class",
            names,
        )
    assert refusal(lambda: load_class("os.path:join", "here")) == (
        "here",
        "'os.path:join' is not a component",
        "a subclass of solfer.components.Component",
    )
    where, what, expected = refusal(lambda: load_class("no_such_module:Class", "here"))
    assert what.startswith("module 'no_such_module' cannot be imported: ModuleNotFoundError: ") and where == "here"
    assert expected == "a module on the Python path (is its catkin workspace sourced?)"
    where, what, expected = refusal(lambda: load_class("solfer.components:Nothing", "here"))
    assert (where, what) == ("here", "unknown class in module solfer.components 'Nothing'")
    assert "Component" in expected


@pytest.fixture
def dry(repository):
    configuration = load(repository / "config/centauro.yaml", "joint_states")
    return DryMiddleware(configuration, robot_files(configuration))


def test_a_dry_run_connects_to_nothing(dry):
    """Checks generate plugins without a robot: ends are inert, yet unknown controllers and parameters are found."""
    assert (dry.name, dry.now(), dry.running()) == ("joint_states", 0.0, False)
    reader, queue, writer = (
        dry.reader("a", "solfer/JointCommand"),
        dry.queue("b", ""),
        dry.writer("c", "std_msgs/String"),
    )
    assert (reader.topic, queue.topic, writer.topic, writer.carries) == ("a", "b", "c", "std_msgs/String")
    assert reader.age() == np.inf and queue.drain() == [] and reader.update() == ()
    service = Service("switch", "test/Switch", object, object, print)
    dry.serve("cart", [service], print)
    assert refusal(lambda: dry.serve("cart", [service], print)) == (
        "",
        "service 'cart/switch' is offered twice",
        "another name",
    )
    assert refusal(lambda: dry.call("gains", "", None, object, 1.0)) == (
        "",
        "the service 'gains' is asked for while the plugin is made",
        "a call in `init`",
    )
    assert dry.topics().result().missing_publisher is not None and not dry.request("a", "", None, object, 1.0).done()
    gains = dry.controller_gains("velocity_controller", 1.0)
    assert set(gains) == {f"j_wheel_{wheel}" for wheel in (1, 2, 3, 4)} and set(gains.values()) == {(0.0, 0.0)}
    assert refusal(lambda: dry.controller_joints("velocity_controler", 1.0, "here"))[:2] == (
        "here",
        "unknown lower-level controller 'velocity_controler'",
    )
    assert refusal(lambda: dry.parameter("/nothing", "here"))[:2] == ("here", "unknown parameter '/nothing'")


def test_two_plugins_command_no_common_number():
    one, other, third, last = (
        (name, frozenset(("arm", field, joint) for field, joint in numbers), where)
        for name, numbers, where in (
            ("one", [("position", "elbow"), ("effort", "elbow"), ("effort", "wrist")], ""),
            ("other", [("position", "elbow"), ("effort", "elbow")], ""),
            ("third", [("velocity", "elbow")], ""),
            ("last", [("velocity", "elbow")], "main.yaml:3:4"),
        )
    )
    assert not list(find_conflicts([one, third], "one of them"))
    found = [(error.where, error.what, error.expected) for error in find_conflicts([third, one, other, last], "one")]
    assert found == [
        ("main.yaml:3:4", "'third' and 'last' both command the velocity of joint 'elbow' (1 numbers in common)", "one"),
        ("controller 'arm'", "'one' and 'other' both command the effort of joint 'elbow' (2 numbers in common)", "one"),
    ]


def test_a_node_and_its_plugin_have_two_names():
    several = Several()
    assert refusal(lambda: several.set.switchboard.serve(None, "two", None)) == (
        "",
        "'two' is a plugin and the node that runs it",
        "two names",
    )


def test_numbers_for_other_plugins_are_finite():
    fields = (("position", np.zeros(2)), ("velocity", np.array([0.0, np.nan])))
    pipe = SimpleNamespace(name="wish", fields=fields, message=SimpleNamespace(names=("elbow", "wrist")))
    assert refusal(lambda: _refuse(pipe)) == (
        "pipe 'wish'",
        "a 'velocity' of 'wrist' for other plugins that is not a finite number",
        "a number in every cycle",
    )


def test_a_component_that_cannot_declare_its_log():
    def fail(_):
        raise ValueError("smoke")

    where, what, expected = refusal(lambda: _declared(SimpleNamespace(name="nod", start_log=fail), None))
    assert what.startswith("the component of 'nod' cannot declare what it logs: ValueError: smoke")
    assert expected == "a `start_log` that calls `logger.add`" and where == ""


def test_a_topic_has_one_publisher():
    topics = [SharedTopic(name, "/wish", "std_msgs/String", f"{name}.yaml:1:1") for name in ("one", "two")]
    error = _rivals(*topics)
    assert (error.where, error.what, error.expected) == (
        "two.yaml:1:1",
        "'one' (one.yaml:1:1) and 'two' both publish the topic '/wish'",
        "a topic for each of them",
    )


@pytest.mark.parametrize(
    ("source", "ways"), [("joints", "with other settings from the same topic"), ("encoders", "from 'encoders'")]
)
@pytest.mark.parametrize(
    ("number", "named"),
    [
        (("state", "position", "elbow"), "the measured position of 'elbow'"),
        (("motor", "effort", "elbow"), "the motor side's effort of 'elbow'"),
        (("contact", "", "foot"), "the wrench of contact 'foot'"),
    ],
)
def test_a_number_has_one_source(source, ways, number, named):
    first, second = received(name="measured"), received(name="others", source=source)
    error = _two_sources(number, (first, "one"), (second, "two"))
    assert error.what == (
        f"{named} has two sources: 'two' receives it by 'others' {ways}, 'one', which shares its Robot, by 'measured' "
        "from 'joints'"
    )
    assert error.expected == (
        f"one source for both, as in {first.where('source')}, or one plugin with model_change that receives either of "
        "them"
    )

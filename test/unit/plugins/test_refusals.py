"""What plugins and their generation refuse."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.unit.joint_pipes import received
from support.unit.refusals import check_refusal

from solfer.config import load
from solfer.errors import ComponentError, MiddlewareError, NotFinite, UnknownName
from solfer.interfaces.declaration import Service
from solfer.plugins.generation.dry_run import DryMiddleware
from solfer.plugins.life.switchboard import find_conflicts
from solfer.plugins.outputs.outputs import _refuse
from solfer.plugins.sharing.groups import _two_sources
from solfer.robot.description.shipped import robot_files
from solfer.telemetry.plugin_log import _declared


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
    assert dry.topics().result().missing_publisher is not None and not dry.request("a", "", None, object, 1.0).done()
    gains = dry.controller_gains("velocity_controller", 1.0)
    assert set(gains) == {f"j_wheel_{wheel}" for wheel in (1, 2, 3, 4)} and set(gains.values()) == {(0.0, 0.0)}
    for call, error, place, words in (
        (lambda: dry.serve("cart", [service], print), MiddlewareError, "", "service 'cart/switch' is offered twice"),
        (
            lambda: dry.call("gains", "", None, object, 1.0),
            MiddlewareError,
            "",
            "'gains' is asked for while",
        ),
        (lambda: dry.controller_joints("wheel", 1.0, "here"), UnknownName, "here", "unknown lower-level controller"),
        (lambda: dry.parameter("/nothing", "here"), UnknownName, "here", "unknown parameter '/nothing'"),
    ):
        check_refusal(call, error, place, words)


def test_two_plugins_command_no_common_number():
    """A pair is reported once, with its first common number; different fields of one joint are no conflict."""
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


def test_numbers_for_other_plugins_are_finite():
    fields = (("position", np.zeros(2)), ("velocity", np.array([0.0, np.nan])))
    pipe = SimpleNamespace(name="wish", fields=fields, message=SimpleNamespace(names=("elbow", "wrist")))
    words = "a 'velocity' of 'wrist' for other plugins that is not a finite number"
    check_refusal(lambda: _refuse(pipe), NotFinite, "pipe 'wish'", words)


def test_a_component_that_cannot_declare_its_log():
    def fail(_):
        raise ValueError("smoke")

    component = SimpleNamespace(name="nod", start_log=fail)
    words = "the component of 'nod' cannot declare what it logs: ValueError: smoke"
    check_refusal(lambda: _declared(component, None), ComponentError, "", words)


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
    assert f"{named} has two sources: 'two' receives it by 'others' {ways}, 'one', which shares" in error.what
    assert first.where("source") in error.expected

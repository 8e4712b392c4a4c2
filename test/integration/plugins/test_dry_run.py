"""`check` and the start of a plugin report the same mistakes: one is a dry run of the other."""

import pytest
import yaml
from support.plugins.plugin import configuration

from solfer.components import Component, Service
from solfer.config import load
from solfer.config.loading.rt_layer import read_layer
from solfer.errors import MiddlewareError, SolferError, singles
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import Registry, check_file, generate, load_checked


class Twins(Component):
    """Offers one service twice."""

    def services(self):
        return (Service("shake", "std_srvs/Trigger", dict, dict, lambda _: None),) * 2


class Sealed(Component):
    """Cannot be made."""

    def __init__(self, robot, tags=None, name=""):
        raise RuntimeError("no key")


def changed(tmp_path, changes, **tags):
    """Write the configuration with other values, by their key path below the root; None removes a key."""
    path = configuration(tmp_path, **tags)
    tree = yaml.safe_load(path.read_text())
    for place, value in changes.items():
        *way, last = place.split("/")
        node = tree["mwoibn"]
        for key in way:
            node = node.setdefault(key, {})
        node[last] = value
    path.write_text(yaml.safe_dump(tree, sort_keys=False))
    return path


def refused(world, path, plugin="joint_states"):
    """Return the errors of a start, and those of a check, by their places."""
    faults: list[SolferError] = []
    try:
        settings = load(path, "test")
        generate(settings, MemoryMiddleware(world.bus, "test"), Registry().find(plugin, settings.module.class_))
    except SolferError as error:
        faults += singles([error])
    report = check_file(path, ["test"], plugin=plugin)
    return {error.where: error for error in faults}, {error.where: error for error in report.errors}


MEASURED, SENT = "ros/feedback/link_side_online", "ros/controller/position_controller"
SPARE = {"type": "reference", "dofs": {"chain": "all", "type": "actuated", "mapping": "RBDL"}}
SPARE |= {"interface": {"position": True}}
TWO = {"controller/one": SPARE, "controller/two": SPARE, "modules/test/controller": ["one", "two"]}
MISTAKES = {
    "an unknown message": ({f"{MEASURED}/message": "sensor_msgs/JointStates"}, "unknown message"),
    "a message of another kind": ({f"{MEASURED}/message": "nav_msgs/Odometry"}, "carries no joints"),
    "an interface without room": (
        {"controller/one": SPARE | {"interface": {"position": True, "effort": True}, "dofs": SPARE["dofs"]},
         "ros/controller/one": {"sink": "a", "message": "nav_msgs/Odometry"}, "modules/test/controller": ["one"]},
        "carries no joints",
    ),
    "a sink without a slash": ({f"{SENT}/sink": "command"}, "without a slash"),
    "a topic that two pipes publish": (
        TWO | {"ros/controller/one": {"sink": "there"}, "ros/controller/two": {"sink": "/there"}},
        "both publish the topic 'there'",
    ),
    "a topic with two messages": (
        TWO | {"ros/controller/one": {"sink": "joint_states"}, "ros/controller/two": {"sink": "there"}},
        "expects solfer/JointCommand on the topic 'joint_states'",
    ),
    "no DoF": (
        {"feedback/link_side_online/dofs/chain": "wheels", "controller/velocity_controller/dofs/chain": "torso"},
        "carries no DoF",
    ),
    "a filter beyond the rate": (
        {"feedback/link_side_online/filter": {"frequency": 150.0}}, "frequency",
    ),
    "no state": ({"modules/test/robot": "empty"}, "receives no state"),
    "a group of a tag": ({"modules/test/chain": "all_legs"}, "unknown group 'all_legs'"),
    "a component of its own": ({"modules/test/class": f"{__name__}:Sealed"}, "cannot be made: RuntimeError: no key"),
    "a service twice": ({"modules/test/class": f"{__name__}:Twins"}, "offered twice"),
    "a point without a port": (
        {"feedback/hand": {"space": "POINT", "quantity": "position", "interface": "world"},
         "ros/feedback/hand": {"source": "hand", "message": "geometry_msgs/PointStamped"},
         "robot/joint_space/feedback": {"list": ["link_side_online", "hand"]}},
        "unknown input of the component 'hand'",
    ),
}  # fmt: skip


@pytest.mark.daily(4)
@pytest.mark.parametrize(("changes", "words"), MISTAKES.values(), ids=MISTAKES)
def test_a_check_refuses_what_a_start_refuses(world, tmp_path, changes, words):
    start, check = refused(world, changed(tmp_path, changes))
    known = {where for where, error in start.items() if not isinstance(error, MiddlewareError)}
    assert "" not in start and known <= set(check), (start, check)
    assert any(words in str(error) for error in check.values()), check


def test_an_unknown_controller_is_found_with_its_name(world, tmp_path):
    lost = {"controller/position_controler": SPARE | {"type": "impedance"}}
    lost |= {"ros/controller/position_controler": {"sink": "/command"}}
    start, check = refused(world, changed(tmp_path, lost | {"modules/test/controller": ["position_controler"]}))
    assert list(start) == list(check)
    (error,) = check.values()
    assert error.names[0] == "position_controller"


def test_a_start_reports_everything_at_once(world, tmp_path):
    changes = {
        "feedback/link_side_online/dofs/chain": "al",
        f"{SENT}/message": "solfer/JointComand",
        "modules/test/speed": "fast",
        "modules/test/wheels": "weels",
    }
    start, check = refused(world, changed(tmp_path, changes))
    assert {str(error) for error in start.values()} == {str(error) for error in check.values()}
    assert len(start) == 3  # the wheels' name is looked up in tags without a mistake
    del changes["modules/test/speed"]
    start, check = refused(world, changed(tmp_path, changes))
    assert {str(error) for error in start.values()} == {str(error) for error in check.values()} and len(start) == 3


def test_mistakes_do_not_hide_those_of_a_dry_run(tmp_path):
    changes = {"modules/test/mode": "ful", f"{SENT}/snik": "x", f"{MEASURED}/message": "sensor_msgs/JointStates"}
    errors = check_file(changed(tmp_path, changes), ["test"], plugin="joint_states").errors
    assert len(errors) == 3 and "JointState" in " ".join(errors[0].names + errors[1].names + errors[2].names)


def test_the_shipped_plugins_are_made_dry(repository):
    report = check_file(repository / "config/centauro.yaml", system="HW")
    assert (report.errors, report.warnings) == ((), ())


def test_gains_need_no_lower_level(repository):
    assert check_file(repository / "test/data/table_1.yaml").errors == ()


def test_a_load_reports_what_a_check_finds(tmp_path):
    changes = {"modules/test/mode": "ful", f"{MEASURED}/message": "sensor_msgs/JointStates"}
    path = changed(tmp_path, changes | {"modules/test/wheels": "weels"})
    with pytest.raises(SolferError) as caught:
        load_checked(path, "test", "joint_states")
    whole = check_file(path, ["test"], plugin="joint_states").errors
    assert [str(each) for each in singles([caught.value])] == [str(each) for each in whole] and len(whole) == 3


def test_an_rt_layer_reports_all_of_its_plugins(tmp_path):
    path = changed(tmp_path, {"modules/test/wheels": "weels", "modules/test/mode": "ful"})
    layer = tmp_path / "layer.yaml"
    plugins = "XBotRTPlugins: {plugins: ['joint_states::test', 'lower_body', 'lower_bod']}"
    layer.write_text(f"{plugins}\nmwoibn: {{config_file: {path}}}\n")
    with pytest.raises(SolferError) as caught:
        read_layer(layer).load(load=load_checked)
    assert all(words in str(caught.value) for words in ("'weels'", "'ful'", "'lower_bod'"))

"""Plugins that share a Robot: each sees what it would see alone, also where one writes it, filters or starts anew."""

import logging

import numpy as np
import pytest
from support.plugins.fleet import JOINTS, SRDF, Fleet, loaded, still, tree
from support.unit.cart import URDF

from solfer.plugins import PluginState, Sharing, check_file
from solfer.plugins.sharing.groups import Writing

NAMES = ("first", "second", "third")


def moving(index, generator):
    """Return the fields of a message of joints that move at random; now and then none."""
    if index % 5 == 4:
        return {}
    return {"position": generator.uniform(-1.0, 1.0, 2), "velocity": generator.uniform(-1.0, 1.0, 2)}


def seen(folder, changed, together, names=NAMES, cycles=60):
    """Return what each plugin received and commanded, and the fleet."""
    fleet, generator = Fleet(folder, changed, names, together), np.random.default_rng(3)
    fleet.cycle(**still())
    for index in range(cycles):
        fleet.cycle(**moving(index, generator))
    rows = [[[array.tobytes() for array in row] for row in plugin.component.seen] for plugin in fleet.plugins]
    return rows, [plugin.robot.command.position.tobytes() for plugin in fleet.plugins], fleet


@pytest.mark.parametrize("estimator", [False, True])
def test_each_sees_what_it_sees_alone(tmp_path, estimator):
    """Plugins that share computations receive and command the same numbers to the bit, and compute less."""
    changed = tree()
    changed["modules"]["third"] |= {"class": "support.plugins.fleet:Balance", "dynamics": True}
    if estimator:
        tags = {"class": "support.plugins.fleet:Estimator", "model_change": True, "controller": ["base"]}
        changed["modules"]["first"] |= tags
        changed["modules"]["second"]["robot"] = changed["modules"]["third"]["robot"] = "based"
    (alone, commanded_alone, apart), (shared, commanded, fleet) = (
        seen(tmp_path, changed, each) for each in (False, True)
    )
    assert shared == alone and commanded == commanded_alone and len(set(commanded)) == 3
    assert min(map(len, shared)) >= 60
    first, *others = (plugin.robot for plugin in fleet.plugins)
    assert all(first.shares_measurement(other) for other in others)
    alone_count = sum(plugin.robot.computations()["kinematics"] for plugin in apart.plugins)
    assert first.computations()["kinematics"] < 0.7 * alone_count


def test_health_counts_what_all_have_computed(tmp_path):
    fleet = Fleet(tmp_path, tree(), NAMES[:2])
    for index in range(5):
        fleet.cycle(**still(shoulder=0.1 * index))
    first, second = (plugin.figures() for plugin in fleet.plugins)
    assert first["computed kinematics"] == second["computed kinematics"] == 5
    assert {name.removeprefix("computed ") for name in first} >= set(fleet.plugins[0].robot.computations())


def test_a_filter_makes_one_step_a_cycle(tmp_path):
    changed = tree()
    for name in NAMES:
        changed["modules"][name]["robot"] = "smooth"
    assert seen(tmp_path, changed, True)[0] == seen(tmp_path, changed, False)[0]


def test_a_filter_begins_anew_with_the_last_plugin(tmp_path):
    """A filter belongs to all that share it: it restarts when each plugin that runs has restarted."""
    changed = tree()
    for name in NAMES[:2]:
        changed["modules"][name]["robot"] = "smooth"
    fleet = Fleet(tmp_path, changed, NAMES[:2])
    position = fleet.plugins[0].robot.state.position
    for _ in range(10):
        fleet.cycle(**still(shoulder=0.0))
    shares = [plugin.feedbacks[0] for plugin in fleet.plugins]
    shares[0].restart()
    fleet.cycle(**still(shoulder=1.0))
    assert 0.0 < position[6:].max() < 0.9  # the other one goes on: the filter, too
    for share in shares:
        share.restart()
    fleet.cycle(**still(shoulder=1.0))
    assert 1.0 in position[6:]
    fleet.asleep.add("second")  # what does not run keeps nobody from beginning anew
    for _ in range(3):
        fleet.cycle(**still(shoulder=1.0))
    shares[0].restart()
    fleet.cycle(**still(shoulder=0.5))
    assert 0.5 in position[6:]


def test_each_plugin_has_its_own_timeout(tmp_path):
    changed = tree()
    changed["feedback"]["patient"] = changed["feedback"]["joints"] | {"timeout": 5.0}
    changed["feedback"]["joints"]["strikes"] = 1
    changed["ros"]["feedback"]["patient"] = dict(changed["ros"]["feedback"]["joints"])
    changed["robot"]["patient"] = changed["robot"]["jointed"] | {"feedback": {"list": ["patient"]}}
    changed["modules"]["second"]["robot"] = "patient"
    fleet = Fleet(tmp_path, changed, NAMES[:2])
    first, second = fleet.plugins
    fleet.cycle(**still())
    assert first.feedbacks[0].source is second.feedbacks[0].source
    for _ in range(60):
        fleet.cycle()
    assert first.life is PluginState.STARTING and second.life is PluginState.RUNNING


def test_wrenches_of_contacts_are_received_once(tmp_path):
    changed, file = tree(), tmp_path / "contacts.yaml"
    file.write_text(
        "cart:\n  contacts:\n    tip: {name: tip, end_frame: arm, type: contact_point, position: [0, 0, -0.5], "
        "constraint_matrix: {force_3: [0, 0, 0, 0, 0, 1]}, initialize: false, interface: world, topic: tip, "
        "message: geometry_msgs/WrenchStamped}\n"
    )
    changed["ros"]["source"]["contacts"] = {"file": str(file)}
    changed["robot"]["jointed"]["contacts"] = {"read": True, "feedback": True}
    changed["robot"]["touching"] = changed["robot"]["jointed"] | {"contacts": {"read": True}}
    changed["modules"]["third"]["robot"] = "touching"
    fleet = Fleet(tmp_path, changed, NAMES)
    pipes = [next(each for each in plugin.feedbacks if each.name == "tip") for plugin in fleet.plugins[:2]]
    assert pipes[0].source is pipes[1].source and len(fleet.plugins[2].feedbacks) == 1
    assert fleet.plugins[0].robot.contacts["tip"] is fleet.plugins[2].robot.contacts["tip"]


def test_one_alone_has_plain_pipes(tmp_path, caplog):
    changed = tree()
    changed["robot"]["jointed"]["actuators"]["read"] = False
    with caplog.at_level(logging.INFO, "solfer"):
        (plugin,) = Fleet(tmp_path, changed, ("first",)).plugins
    assert not hasattr(plugin.feedbacks[0], "source") and "'first' has a Robot of its own" in caplog.text


def test_the_log_tells_who_shares(tmp_path, caplog):
    changed = tree()
    changed["modules"]["third"]["secondary_file"] = {"file": str(tmp_path / "third.yaml")}
    (tmp_path / "third.yaml").write_text("mwoibn: {robot: {rate: 100.0}}\n")
    with caplog.at_level(logging.INFO, "solfer"):
        sharing = Sharing(loaded(tmp_path, changed, NAMES))
    assert "'first', 'second' share one Robot" in caplog.text
    assert "'third' has a Robot of its own: another rate than 'first'" in caplog.text
    assert sharing.turns.number == 0 and Writing("first", "base") != Writing("second", "base")


def test_the_check_of_a_shared_plugin_finds_two_sources(tmp_path):
    changed = tree()
    (tmp_path / "cart.urdf").write_text(URDF)
    (tmp_path / "cart.srdf").write_text(SRDF)
    changed["ros"]["source"] = {name: {"file": str(tmp_path / f"cart.{name}")} for name in ("urdf", "srdf")}
    changed["feedback"]["encoders"]["dofs"] = JOINTS | {"chain": "front"}
    changed["modules"]["second"]["robot"] = "encoded"
    changed["modules"]["shared"] = {"layer": "NRT", "plugins": ["any::first", "any::second"]}
    loaded(tmp_path, changed, ())
    errors = check_file(tmp_path / "main.yaml").errors
    assert [str(error).count("the measured position of 'shoulder' has two sources") for error in errors] == [1]
    changed["modules"]["shared"]["plugins"] = ["any::first", "any::third"]
    loaded(tmp_path, changed, ())
    assert not check_file(tmp_path / "main.yaml").errors


def test_the_longest_history_counts(tmp_path):
    """Feedbacks that differ in their `history` are one, and all plugins have every message."""
    changed = tree()
    for name, length in (("short", 3), ("long", 9)):
        changed["feedback"][name] = changed["feedback"]["joints"] | {"history": length}
        changed["ros"]["feedback"][name] = changed["ros"]["feedback"]["joints"]
        changed["robot"][name] = changed["robot"]["jointed"] | {"feedback": {"list": [name]}}
    for plugin, robot in zip(NAMES, ("jointed", "short", "long"), strict=True):
        changed["modules"][plugin]["robot"] = robot
    fleet = Fleet(tmp_path, changed, NAMES)
    for index in range(6):
        fleet.publish(**still(shoulder=0.05 * index))
    fleet.cycle()
    histories = [plugin.robot.state.histories for plugin in fleet.plugins]
    assert histories[0] is histories[1] is histories[2] and len(histories[0]) == 1
    assert (histories[0][0].size, histories[0][0].count) == (9, 6)
    assert all("joints dropped" not in plugin.figures() for plugin in fleet.plugins)
    for _ in range(10):
        fleet.publish(**still())
    fleet.cycle()
    assert fleet.plugins[1].figures()["short dropped"] == 1


def test_a_history_of_what_another_plugin_writes_is_received(tmp_path):
    changed = tree()
    tags = {"class": "support.plugins.fleet:Estimator", "model_change": True, "controller": ["base"]}
    changed["modules"]["first"] |= tags
    changed["modules"]["second"]["robot"] = "based"
    changed["feedback"]["base"] |= {"history": 4}
    fleet = Fleet(tmp_path, changed, NAMES[:2])
    for _ in range(3):
        fleet.cycle(**still())
    (history,) = fleet.plugins[1].robot.state.histories
    assert history.count == 1 and fleet.plugins[1].feedbacks[-1].received

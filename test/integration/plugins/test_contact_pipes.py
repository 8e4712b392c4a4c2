"""Forces of the ground on the simulated CENTAURO with the shipped configuration; and what the commands print."""

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from support.integration.world import CONFIG
from support.plugins.plugin import configuration

from solfer.errors import PipeError, SolferError, UnknownName
from solfer.plugins import PluginState, check_file
from solfer_tools.cli.main import main

WHEELS = ("front_left_leg", "front_right_leg", "rear_left_leg", "rear_right_leg")
ROBOT = {"class": "support.plugins.body_pipes:Watcher", "kinematics": True, "controller": []}


def file_of(tmp_path, change=None, **tags):
    """Write the shipped configuration with a module `test` that receives the true base and the contacts."""
    path = configuration(tmp_path, **ROBOT, robot="base_velocity", **tags)
    if change is not None:
        tree = yaml.safe_load(path.read_text())
        change(tree["mwoibn"])
        path.write_text(yaml.safe_dump(tree))
    return path


def lists(space="CONTACT", names=WHEELS, **tags):
    """Make a change: the robot lists pipes of contacts instead of taking them from the contacts' file.

    The module has the name `listed`, too.
    """

    def change(root):
        root["modules"]["listed"] = root["modules"]["test"]
        root["robot"]["base_velocity"]["contacts"] = {"read": True}
        root["robot"]["base_velocity"]["feedback"]["list"] += names
        for name in names:
            root["feedback"][name] = {
                "space": space,
                "source": f"contacts/{name}",
                "message": "gazebo_msgs::ContactsState",
                "initialize": True,
                **tags,
            }

    return change


def weight(world):
    return 9.81 * world.simulation.body.mass()


def test_contacts_of_the_file_carry_the_weight(world, tmp_path):
    plugin = world.plugin("test", file_of(tmp_path))
    names = [feedback.name for feedback in plugin.feedbacks]
    assert names == ["link_side_online", "floating_base", *WHEELS, "left_arm", "right_arm"]
    world.run(2.0)
    robot = plugin.robot
    assert plugin.life is PluginState.RUNNING
    assert_allclose(robot.contacts.forces.sum(axis=0), (0.0, 0.0, weight(world)), atol=1e-3 * weight(world))
    assert robot.contacts.forces[:4, 2].min() > 0.1 * weight(world)
    assert not robot.contacts.wrenches[4:].any()
    moment = robot.contacts.wrenches[:4, 3:]  # wheels touch at points, which bear no moment
    assert_allclose(moment, 0.0, atol=0.05)


def test_world_and_link_axes_give_equal_forces(world, tmp_path):
    (tmp_path / "listed").mkdir()
    fixed = world.plugin("test", file_of(tmp_path))
    listed = world.plugin("listed", file_of(tmp_path / "listed", lists()))
    world.simulation.pushes.add("pelvis", (80.0, 60.0, 0.0), (10.0, 20.0, 30.0), 0.5)
    world.run(0.4)
    assert np.abs(fixed.robot.contacts.forces[:4, :2]).max() > 20.0
    # joints are measured at the end of a step, wrenches are those at its beginning: links turn on for a millisecond
    assert_allclose(listed.robot.contacts.wrenches[:4], fixed.robot.contacts.wrenches[:4], atol=0.05)


def test_a_robot_in_the_air_feels_no_ground(world, tmp_path):
    plugin = world.plugin("test", file_of(tmp_path))
    world.run(0.5)
    before = plugin.robot.center_of_pressure.value.copy()
    world.simulation.pushes.add("pelvis", (0.0, 0.0, 3.0 * weight(world)), (0.0, 0.0, 0.0), 0.3)
    world.run(0.3)
    assert not plugin.robot.contacts.forces.any()
    assert_allclose(plugin.robot.center_of_pressure.value, before, atol=0.1)  # nothing presses: the value stays


def test_a_part_receives_its_own_contacts(world, tmp_path):
    secondary = {"file": str(CONFIG / "support/lower_body.yaml")}
    plugin = world.plugin("test", file_of(tmp_path, secondary_file=secondary))
    assert plugin.robot.contacts.names == WHEELS
    assert [feedback.name for feedback in plugin.feedbacks][2:] == list(WHEELS)
    world.run(2.0)
    assert_allclose(plugin.robot.contacts.forces.sum(axis=0)[2], weight(world), rtol=1e-3)


def test_unread_contacts_are_not_received(world, tmp_path):
    def change(root):
        root["robot"]["base_velocity"]["contacts"]["feedback"] = False

    plugin = world.plugin("test", file_of(tmp_path, change))
    assert [feedback.name for feedback in plugin.feedbacks] == ["link_side_online", "floating_base"]
    assert plugin.robot.contacts.names[:4] == WHEELS


@pytest.mark.daily(1)
@pytest.mark.parametrize(
    "change, error, words",
    [
        (lists(contact="front_leg"), UnknownName, "unknown contact 'front_leg'"),
        (lists(names=("front_left_leg", "left_leg")), UnknownName, "unknown contact 'left_leg'"),
        (
            lambda root: (lists()(root), root["robot"]["base_velocity"].update(contacts={"read": False})),
            PipeError,
            "carries contacts, but the Robot has none",
        ),
    ],
)
def test_mistakes_are_found_checking_and_running(world, tmp_path, change, error, words):
    path = file_of(tmp_path, change)
    found = [str(each) for each in check_file(path, ["test"]).errors]
    assert any(words in each and each.startswith(str(path)) for each in found), found
    with pytest.raises(SolferError, match=words) as caught:
        world.plugin("test", path)
    faults = getattr(caught.value, "errors", (caught.value,))
    assert all(isinstance(fault, error) and fault.where.startswith(str(path)) for fault in faults)


def test_a_wrong_file_of_contacts_is_named(tmp_path):
    contacts = tmp_path / "contacts.yaml"
    contacts.write_text("centauro: {contacts: {contact0: {name: 3}}}\n")

    def change(root):
        root["ros"]["source"]["contacts"] = {"file": str(contacts)}

    (error, *_) = check_file(file_of(tmp_path, change), ["test"]).errors
    assert str(contacts) in str(error) and "contact0" in str(error)


def test_the_commands_know_pipes_of_contacts(tmp_path, capsys):
    path = str(file_of(tmp_path))
    assert main(["list", "pipes", path, "-n", "test"]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("rear_left_leg")]
    for word in (
        "feedback",
        "CONTACT",
        "measured wrench of rear_left_leg",
        "axes of its link",
        "contacts/rear_left_leg/link",
    ):
        assert word in line
    assert main(["graph", path, "-n", "test"]) == 0
    assert "contacts/rear_left_leg/link" in capsys.readouterr().out
    assert check_file(path, ["test"]).errors == ()

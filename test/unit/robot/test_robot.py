"""The Robot and its builder."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from solfer import Robot
from solfer.config import load
from solfer.errors import ConfigError, MiddlewareError, ModelError, ServiceUnavailable, SolferErrors, UnknownName
from solfer.model import Description, Kinematics
from solfer.model.urdf.cut import cut
from solfer.robot import build
from solfer.robot.description.shipped import robot_of

ROOT = Path(__file__).parents[3]
CENTAURO = ROOT / "config/robots/centauro"
URDF, SRDF, ACTUATORS, CONTACTS = (
    CENTAURO / name for name in ("centauro.urdf", "centauro.srdf", "actuators.yaml", "contacts.yaml")
)
WHEELS = ("j_wheel_4", "j_wheel_3", "j_wheel_2", "j_wheel_1")

MAIN = """
mwoibn:
  middleware: ROS
  system: SM
  robot:
    name: centauro
    rate: 200
    joint_space: {{feedback: {{list: [joints]}}, actuators: {{read: true}}, contacts: {{read: true}}}}
  feedback:
    joints:
      space: JOINT
      dofs: {{chain: {chain}, type: actuated, mapping: {mapping}}}
      interface: {{position: true}}
      function: state
  controller:
    reference: {{type: reference, dofs: {{chain: all, type: all, mapping: RBDL}}, interface: {{position: true}}}}
    wheels: {{type: velocity, dofs: {{chain: wheels, type: all, mapping: LOWER_LEVEL}}, interface: {{velocity: true}}}}
  ros:
    source: {{urdf: {urdf}, srdf: /srdf, actuators: /actuators, contacts: /contacts}}
    mapping:
      PYTHON: {{loading: topic, source: order, message: sensor_msgs/JointState}}
      RBDL_LOWER: {{loading: model, urdf: /lower}}
      RBDL_UPPER: {{loading: model, urdf: {{file: upper.urdf}}}}
    feedback: {{joints: {{source: joint_states, message: sensor_msgs/JointState, initialize: {initialize}}}}}
    controller: {{reference: {{sink: desired}}, wheels: {{sink: /command}}}}
  modules:
    test:
      layer: NRT
      robot: joint_space
      controller: [reference, wheels]
      mode: {mode}
      kinematics: true
      dynamics: false
      model_change: false
"""


class NotedMiddleware:
    """A middleware with some parameters, topics and controllers, that notes the requested waits."""

    def __init__(self, parameters):
        self.parameters, self.waited = parameters, []
        self.orders = {"joint_states": ("camera", "torso_yaw", *WHEELS), "order": ("torso_yaw", "hip_yaw_1")}
        self.controllers = {"wheels": WHEELS}
        self.received = set()

    def parameter(self, name, where=""):
        if name not in self.parameters:
            raise UnknownName("parameter", name, self.parameters, where=where)
        return self.parameters[name]

    def joint_order(self, topic, message, timeout, where=""):
        self.waited.append(topic)
        if topic not in self.orders:
            raise MiddlewareError(f"nothing on topic '{topic}' within {timeout:g} s", where=where)
        return self.orders[topic]

    def controller_joints(self, controller, timeout, where=""):
        self.waited.append(controller)
        if controller not in self.controllers:
            raise ServiceUnavailable(f"there is no controller '{controller}'", where=where)
        return self.controllers[controller]

    def is_received(self, topic, message):
        return (topic, message) in self.received


@pytest.fixture(scope="module")
def whole():
    return Description.from_file(URDF)


@pytest.fixture(scope="module")
def parts(whole):
    return {keep: cut(whole, "torso_2", keep) for keep in ("lower", "upper")}


@pytest.fixture
def outside(whole, parts):
    return NotedMiddleware(
        {
            "/urdf": whole.text,
            "/srdf": SRDF.read_text(),
            "/actuators": ACTUATORS.read_text(),
            "/contacts": CONTACTS.read_text(),
            "/lower": parts["lower"],
        }
    )


@pytest.fixture
def configured(tmp_path, parts):
    def make(**changes):
        (tmp_path / "upper.urdf").write_text(parts["upper"])
        values = {"chain": "all", "mapping": "FEEDBACK", "urdf": "/urdf", "initialize": "true", "mode": "full"}
        (tmp_path / "main.yaml").write_text(MAIN.format(**(values | changes)))
        return load(tmp_path / "main.yaml", "test")

    return make


@pytest.fixture
def robot():
    return Robot.load(URDF, SRDF, actuators=ACTUATORS)


def test_states_limits_and_maps_have_the_robots_size(robot):
    assert robot.size == 48 and robot.dofs[:6] == ("x", "y", "z", "rx", "ry", "rz")
    for state in (robot.state, robot.motor, robot.command, robot.lower_limits, robot.upper_limits):
        assert state.dofs == robot.dofs
    assert_array_equal(robot.actuated, np.arange(6, 48))
    assert robot.maps["RBDL"] is robot.maps["MODEL"]
    assert robot.maps["RBDL"].external == robot.dofs
    assert robot.maps["ACTUATED"].external == robot.dofs[6:]
    assert robot.actuators["hip_yaw_1"].stiffness == 80000
    assert_allclose(robot.gravity, (0, 0, -9.81))
    assert repr(robot) == ("Robot(centauro: 48 DoFs, 42 actuated, 29 groups, 40 states, maps RBDL, MODEL, ACTUATED)")


def test_limits_are_from_the_urdf_or_infinite(robot):
    hip, joint = robot.dof("hip_pitch_1"), robot.description.joints["hip_pitch_1"]
    assert robot.lower_limits.position[hip] == joint.lower and robot.upper_limits.position[hip] == joint.upper
    assert robot.lower_limits.velocity[hip] == -joint.velocity and robot.upper_limits.velocity[hip] == joint.velocity
    assert robot.lower_limits.torque[hip] == -joint.effort and robot.upper_limits.torque[hip] == joint.effort
    assert robot.upper_limits.position[robot.dof("j_wheel_1")] == np.inf
    assert (robot.lower_limits.torque[:6] == -np.inf).all()
    assert (robot.upper_limits.acceleration == np.inf).all()


def test_selectors_are_the_groups_and_all(robot):
    assert list(robot.selectors) == ["all", *robot.semantics.groups]
    assert robot.selectors["base"].names == robot.dofs[:6]
    assert robot.selectors["lower_body"].size == 30
    assert robot.selectors["wheels"].names == WHEELS[::-1]
    assert robot.selectors["force_torque_sensors"].size == 0
    assert robot.links("manipulation") == ("arm1_7", "arm2_7") and len(robot.links("all")) == 57


def test_named_states_are_indices_and_values(robot):
    indices, values = robot.named_state("ankles")
    assert [robot.dofs[index] for index in indices] == ["ankle_yaw_1", "ankle_yaw_2"]
    assert_allclose(values, (-0.6, 0.6))


@pytest.mark.parametrize(
    "call, kind, name, nearest",
    [
        ("dof", "DoF", "hip_yaw1", "hip_yaw_1"),
        ("links", "group", "wheel", "wheels"),
        ("named_state", "state", "mamal", "mammal"),
    ],
)
def test_unknown_names_offer_the_nearest(robot, call, kind, name, nearest):
    with pytest.raises(UnknownName, match=f"unknown {kind} '{name}'") as caught:
        getattr(robot, call)(name)
    assert nearest in caught.value.names


def test_update_works_only_when_position_or_velocity_changed(robot):
    assert robot.update()
    assert not robot.update()
    before = robot.kinematics.position("torso_2").copy()
    robot.state.position[2] += 0.5
    assert robot.update()
    assert_allclose(robot.kinematics.position("torso_2") - before, (0, 0, 0.5), atol=1e-12)
    assert robot.center_of_mass.value[2] > 0.5
    robot.state.velocity[0] = 0.1
    assert robot.update()
    assert robot.kinematics.velocity("torso_2")[0] == pytest.approx(0.1)
    robot.state.torque[:] = 1.0
    assert not robot.update()


def test_texts_and_an_added_base_are_understood():
    urdf = (
        '<robot name="box"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1"'
        ' izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="j" type="continuous"><parent link="a"/>'
        '<child link="b"/></joint></robot>'
    )
    srdf = '<robot name="box"><group name="base"><link name="a"/></group></robot>'
    robot = Robot.load(urdf, srdf, floating_base=True, name="crate")
    assert (robot.name, robot.size) == ("crate", 7)
    assert robot.selectors["base"].names == robot.dofs[:6]
    assert Robot.load(urdf, srdf).selectors["base"].size == 0
    assert_array_equal(Robot.load(urdf).actuated, (0,))


def test_a_part_loads_from_files_of_the_whole(parts):
    robot = Robot.load(parts["upper"], SRDF, actuators=ACTUATORS, others=[URDF])
    assert robot.size == 18 and robot.selectors["wheels"].size == 0 and robot.selectors["arms"].size == 14
    assert len(robot.actuators) == 18
    assert set(robot.dofs[index] for index in robot.named_state("home")[0]) <= set(robot.dofs)


def test_a_part_alone_leaves_out_what_it_lacks(parts, caplog):
    robot = Robot.load(parts["upper"], SRDF)
    assert robot.selectors["wheels"].size == 0 and robot.selectors["arms"].size == 14
    assert "group 'front_left_leg': unknown link 'wheel_1'" in caplog.text


def test_missing_files_are_named(tmp_path):
    with pytest.raises(ModelError, match="none.urdf"):
        Robot.load(tmp_path / "none.urdf")


def test_builder_makes_the_paper_s_maps(configured, outside):
    """The paper's configuration gives its maps, by name, with the outside's joint order, and all contacts."""
    robot = build(configured(), outside)
    assert set(robot.maps) == {
        "RBDL",
        "MODEL",
        "ACTUATED",
        "RBDL_LOWER",
        "RBDL_UPPER",
        "FEEDBACK",
        "ros_control::wheels",
        "LOWER_LEVEL",
    }
    assert robot.maps["FEEDBACK"].external == ("camera", "torso_yaw", *WHEELS)
    assert robot.maps["LOWER_LEVEL"].external == robot.maps["ros_control::wheels"].external == WHEELS
    assert outside.waited == ["wheels", "joint_states"]
    assert len(robot.actuators) == 42
    assert [contact.link for contact in robot.contacts] == [
        "wheel_1",
        "wheel_2",
        "wheel_3",
        "wheel_4",
        "arm1_7",
        "arm2_7",
    ]


def test_listing_1_maps_to_other_models(configured, outside):
    robot = build(configured(), outside)
    lower, upper = robot.maps["RBDL_LOWER"], robot.maps["RBDL_UPPER"]
    assert (lower.size, upper.size) == (30, 18)
    values = np.arange(48.0)
    out = lower.to_external(values, np.zeros(30))
    assert [robot.dofs[int(value)] for value in out] == list(lower.external)
    assert_array_equal(np.union1d(lower.robot_indices, upper.robot_indices), np.arange(48))


def test_a_topic_map_in_use_is_loaded(configured, outside):
    robot = build(configured(mapping="PYTHON", initialize="false"), outside)
    assert robot.maps["PYTHON"].external == ("torso_yaw", "hip_yaw_1")
    assert "FEEDBACK" not in robot.maps and outside.waited == ["wheels", "order"]


def test_idle_plugins_need_no_controller(configured, outside, caplog):
    assert build(configured(mode="idle"), outside).maps["LOWER_LEVEL"].external == WHEELS
    outside.controllers = {}
    with caplog.at_level("INFO"):
        robot = build(configured(mode="idle"), outside)
    assert robot.maps["LOWER_LEVEL"].external == tuple(np.array(robot.dofs)[robot.actuated])
    assert "there is no controller 'wheels'" in caplog.text


def test_a_foreign_controller_need_not_name_joints(configured, outside, caplog):
    """Where a node receives its commands, those of the pipe are taken, with one warning."""
    outside.controllers = {}
    with pytest.raises(MiddlewareError, match="there is no controller 'wheels'"):
        build(configured(), outside)
    outside.received = {("wheels/command", "solfer/JointCommand")}
    assert set(build(configured(), outside).maps["LOWER_LEVEL"].external) == set(WHEELS)
    (warning,) = (record.message for record in caplog.records if record.levelname == "WARNING")
    assert warning.startswith("there is no controller 'wheels'; commands are for j_wheel_")


def test_a_part_is_built_from_the_whole(configured, outside):
    robot = build(configured(urdf="/lower"), outside)
    assert robot.size == 30 and robot.selectors["arms"].size == 0 and len(robot.actuators) == 24
    assert len(robot.maps["FEEDBACK"].robot_indices) == 4
    assert [contact.link for contact in robot.contacts] == ["wheel_1", "wheel_2", "wheel_3", "wheel_4"]


def test_actuators_may_come_as_rosparam_loads_them(configured, outside):
    outside.parameters["/actuators"] = {
        "centauro": {
            "actuators": {"torso_yaw": {"type": "SEA", "Ks": 1.0, "D": 0.0, "B": 0.0, "phi": 0.0, "Torque_limit": 2.0}}
        }
    }
    assert build(configured(), outside).actuators.names == ("torso_yaw",)


def test_contacts_may_come_from_rosparam(configured, outside):
    contact = {
        "name": "hand",
        "end_frame": "arm1_77",
        "type": "contact_point",
        "position": [0.0, 0.0, -0.1],
        "constraint_matrix": {"force_1": [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]},
    }
    outside.parameters["/contacts"] = {"centauro": {"contacts": {"contact0": contact}}}
    with pytest.raises(UnknownName, match="unknown link 'arm1_77'") as caught:
        build(configured(), outside)
    assert "arm1_7" in caught.value.names and "/contacts" in caught.value.where
    contact["end_frame"] = "arm1_7"
    assert_allclose(build(configured(), outside).contacts[0].position.fixed, (0.0, 0.0, -0.1), atol=1e-12)


def test_names_are_checked_before_anything_is_waited_for(configured, outside):
    with pytest.raises(SolferErrors) as caught:
        build(configured(chain="wheel", mapping="FEEDBAK"), outside)
    group, mapping = caught.value.errors
    assert group.what == "unknown group 'wheel'" and group.names[0] == "wheels" and "main.yaml:12:" in group.where
    assert mapping.what == "unknown map 'FEEDBAK'" and mapping.names[0] == "FEEDBACK"
    assert "main.yaml:12:" in mapping.where
    assert outside.waited == []


def test_missing_sources_are_reported_at_once(configured, outside):
    outside.orders, outside.controllers = {}, {}
    with pytest.raises(SolferErrors) as caught:
        build(configured(), outside)
    assert [str(error.what) for error in caught.value.errors] == [
        "there is no controller 'wheels'",
        "nothing on topic 'joint_states' within 0.5 s",
    ]
    assert all("main.yaml:" in error.where for error in caught.value.errors)


def test_descriptions_that_are_not_there_are_reported_together(configured, outside):
    del outside.parameters["/srdf"], outside.parameters["/actuators"]
    with pytest.raises(SolferErrors) as caught:
        build(configured(), outside)
    assert [error.name for error in caught.value.errors] == ["/srdf", "/actuators"]


def test_an_unused_map_may_be_missing(configured, outside, caplog):
    del outside.parameters["/lower"]
    with caplog.at_level("INFO"):
        assert "RBDL_LOWER" not in build(configured(), outside).maps
    assert "RBDL_LOWER" in caplog.text
    with pytest.raises(UnknownName, match="unknown parameter '/lower'"):
        build(configured(mapping="RBDL_LOWER"), outside)


@pytest.mark.parametrize(
    "name, value, what",
    [
        ("/urdf", 3, "is not a text"),
        ("/urdf", "<html/>", "parameter /urdf: not a URDF"),
        ("/srdf", {"a": 1}, "is not a text"),
        ("/actuators", "{}", "no actuators of 'centauro'"),
        ("/actuators", "centauro: {actuators: {hip: {type: SEA}}}", "parameter /actuators:1:"),
    ],
)
def test_parameters_that_hold_something_else_are_refused(configured, outside, name, value, what):
    outside.parameters[name] = value
    with pytest.raises((ConfigError, ModelError, SolferErrors)) as caught:
        build(configured(), outside)
    assert what in str(caught.value)


CART = """<robot name="cart"><link name="body"/><link name="load"/>
  <joint name="slide" type="prismatic"><parent link="body"/><child link="load"/>
    <limit lower="-1" upper="1" velocity="1" effort="10"/></joint></robot>"""


def test_a_description_gets_and_loses_its_base():
    """A model of the new description is the one that Kinematics makes of the old one."""
    cart = Description.from_text(CART)
    for floating, size in ((True, 7), (False, 1)):
        based = cart.with_base(floating)
        assert Kinematics(based).size == size == Kinematics(cart, floating).size
        assert based.with_base(floating) is based and based.with_base(None) is based
        assert Kinematics(based.with_base(False)).size == 1
    assert Kinematics(cart.with_base(True)).base_link == "body"


@pytest.mark.parametrize(("said", "size"), [("true", 48), ("false", 42), ("", 42)])
def test_the_bundle_decides_whether_the_base_floats(configured, outside, whole, tmp_path, said, size):
    """It counts for the whole robot, and not for a part with another root."""
    configuration = configured()
    folder = tmp_path / "robots/centauro"
    folder.mkdir(parents=True)
    fixed = whole.with_base(False)
    (folder / "centauro.urdf").write_text(fixed.text)
    line = f"floating_base: {said}\n" if said else ""
    (folder / "robot.yaml").write_text(f"name: centauro\nurdf: centauro.urdf\n{line}")
    outside.parameters["/urdf"] = fixed.text
    assert build(configuration, outside).size == size
    outside.parameters["/urdf"] = whole.text
    assert build(configuration, outside).size == (42 if said == "false" else 48)


def test_a_robot_is_found_by_its_name_or_its_bundle():
    assert robot_of(str(CENTAURO / "robot.yaml")) == robot_of("centauro")
    assert robot_of("centauro")[1].contacts == CONTACTS
    with pytest.raises(UnknownName, match="centauro"):
        robot_of("centaur")

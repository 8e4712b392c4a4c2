"""Groups and states of an SRDF."""

import math
from pathlib import Path

import pytest

from solfer.errors import ModelError, SolferErrors, UnknownName
from solfer.model import Description, Semantics
from solfer.model.urdf.cut import cut

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
ARM = Description.from_text("""<robot name="arm">
  <link name="base"/><link name="upper"/><link name="fore"/><link name="hand"/><link name="lamp"/>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/></joint>
  <joint name="wrist" type="fixed"><parent link="fore"/><child link="hand"/></joint>
  <joint name="pole" type="continuous"><parent link="base"/><child link="lamp"/></joint>
</robot>""")


@pytest.fixture(scope="module")
def centauro():
    return Description.from_file(CENTAURO / "centauro.urdf")


def arm(content):
    return Semantics.from_text(f'<robot name="arm">{content}</robot>', ARM, "arm.srdf")


def test_centauro_has_its_groups_and_states(centauro):
    """Counts and members of the shipped SRDF, through chains, subgroups, and groups of links without joints."""
    semantics = Semantics.from_file(CENTAURO / "centauro.srdf", centauro)
    groups = semantics.groups
    assert (len(groups), len(semantics.states)) == (29, 40)
    assert groups["wheels"].joints == ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")
    assert groups["front_left_leg"].joints == (
        "hip_yaw_1",
        "hip_pitch_1",
        "knee_pitch_1",
        "ankle_pitch_1",
        "ankle_yaw_1",
        "j_wheel_1",
    )
    assert groups["base"].joints == ("reference",) and groups["base"].links == ("pelvis",)
    assert groups["imu_sensors"].joints == () and groups["imu_sensors"].links == ("imu_link",)
    assert groups["force_torque_sensors"].joints == groups["force_torque_sensors"].links == ()
    assert len(groups["lower_body"].joints) == 25 and len(groups["chains"].joints) == 40
    assert semantics.states["mammal_wide_high"]["hip_pitch_1"] == -1.27


def test_members_are_kept_once_in_their_order():
    semantics = arm(
        '<group name="all"><group name="tip"/><link name="fore"/><joint name="shoulder"/></group>'
        '<group name="tip"><chain base_link="upper" tip_link="hand"/></group>'
    )
    assert semantics.groups["tip"].joints == ("elbow",)
    assert semantics.groups["tip"].links == ("fore", "hand")
    assert semantics.groups["all"].joints == ("elbow", "shoulder")
    assert semantics.groups["all"].links == ("fore", "hand", "upper")
    assert list(semantics.groups) == ["all", "tip"]


def test_states_of_one_name_are_merged():
    text = '<group name="a"/><group name="b"/>{}{}'
    first = '<group_state name="home" group="a"><joint name="elbow" value=" 0.5"/></group_state>'
    second = '<group_state name="home" group="{}"><joint name="shoulder" value="-1e-1"/></group_state>'
    assert arm(text.format(first, second.format("b"))).states == {"home": {"elbow": 0.5, "shoulder": -0.1}}
    with pytest.raises(ModelError, match="group_state 'home': the state stands twice"):
        arm(text.format(first, second.format("a")))


def test_virtual_joints_are_known_and_hold_no_value():
    semantics = arm(
        '<virtual_joint name="root" type="floating" parent_frame="w" child_link="base"/>'
        '<group name="a"><joint name="root"/><link name="base"/></group>'
        '<group_state name="s" group="a"><joint name="root" value="0 0 1 0 0 0 1"/></group_state>'
    )
    assert semantics.groups["a"].links == ("base",) and semantics.states == {"s": {}}


@pytest.mark.parametrize(
    "content, kind, name, nearest",
    [
        ('<group name="a"><link name="hnd"/></group>', "link", "hnd", "hand"),
        ('<group name="a"><joint name="elbo"/></group>', "joint", "elbo", "elbow"),
        ('<group name="arms"/><group name="a"><group name="arm"/></group>', "group", "arm", "arms"),
        ('<group name="a"><chain base_link="base" tip_link="hnd"/></group>', "link", "hnd", "hand"),
        (
            '<group name="a"/><group_state name="s" group="a"><joint name="elbo" value="1"/></group_state>',
            "joint",
            "elbo",
            "elbow",
        ),
        ('<group name="arm"/><group_state name="s" group="arms"/>', "group", "arms", "arm"),
    ],
)
def test_unknown_names_offer_the_nearest(content, kind, name, nearest):
    with pytest.raises(UnknownName, match=f"arm.srdf: group.* '.*': unknown {kind} '{name}'") as caught:
        arm(content)
    assert nearest in caught.value.names


@pytest.mark.parametrize(
    "content, what",
    [
        ('<group name="a"/><group name="a"/>', "group 'a': the group stands twice"),
        ("<group/>", "a group has no name"),
        (
            '<group name="a"><group name="b"/></group><group name="b"><group name="a"/></group>',
            "group 'a': the group contains itself: a > b > a",
        ),
        (
            '<group name="a"><chain base_link="lamp" tip_link="hand"/></group>',
            "group 'a': no chain leads from link 'lamp' out to link 'hand'",
        ),
        ('<group name="a"><frame name="hand"/></group>', "unknown member <frame>"),
        ('<group name="a"/><group_state group="a"/>', "a group_state has no name"),
        *[
            (
                f'<group name="a"/><group_state name="s" group="a"><joint name="elbow" value="{value}"/></group_state>',
                f"group_state 's': value \"{value}\" of joint 'elbow'",
            )
            for value in ("high", "", "nan", math.inf)
        ],
        (
            '<group name="a"/><group_state name="s" group="a"><joint name="elbow" value="1"/>'
            '<joint name="elbow" value="2"/>'
            "</group_state>",
            "joint 'elbow' stands twice",
        ),
    ],
)
def test_faults_name_their_element(content, what):
    with pytest.raises(ModelError) as caught:
        arm(content)
    assert what in str(caught.value)


@pytest.mark.parametrize("text, what", [("", "empty"), ("<robot", "not XML"), ("<html/>", "not an SRDF")])
def test_what_is_no_srdf_is_refused(text, what):
    with pytest.raises(ModelError, match=what):
        Semantics.from_text(text, ARM)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ModelError, match=r"none\.srdf: the SRDF cannot be read"):
        Semantics.from_file(tmp_path / "none.srdf", ARM)


def test_all_faults_are_reported_at_once():
    with pytest.raises(SolferErrors) as caught:
        arm('<group name="a"><link name="x"/><joint name="y"/></group><group_state name="s" group="b"/>')
    assert len(caught.value.errors) == 3


def test_an_unknown_name_is_reported_once():
    with pytest.raises(UnknownName, match="group_state 's': unknown joint 'elbo'"):
        arm(
            '<group name="a"/>'
            + "".join(
                f'<group_state name="{name}" group="a"><joint name="elbo" value="1"/></group_state>' for name in "st"
            )
        )


@pytest.mark.parametrize("keep, joints, links", [("upper", 15, 15), ("lower", 25, 25)])
def test_semantics_of_the_whole_serve_its_parts(centauro, keep, joints, links):
    part = Description.from_text(cut(centauro, "torso_2", keep), keep)
    semantics = Semantics.from_file(CENTAURO / "centauro.srdf", part, others=(centauro,))
    group = semantics.groups[f"{keep}_body"]
    assert (len(group.joints), len(group.links)) == (joints, links)
    assert set(semantics.states["home"]) <= set(part.joints)


def test_a_part_alone_leaves_out_the_rest(centauro, caplog):
    """Without the whole beside it, chains across the cut and joints of the other part are named in a warning."""
    part = Description.from_text(cut(centauro, "torso_2", "lower"), "lower")
    semantics = Semantics.from_file(CENTAURO / "centauro.srdf", part)
    assert len(semantics.groups["lower_body"].joints) == 25 and semantics.groups["left_arm"].joints == ()
    assert "torso_yaw" not in semantics.states["home"] and len(semantics.states["home"]) > 10
    (message,) = caplog.messages
    assert "centauro.srdf: left out" in message and "group 'left_arm': unknown link 'arm1_7'" in message
    assert message.endswith("and 12 more")


def test_names_that_the_robot_lacks_are_left_out(caplog):
    """SRDF files often belong to a larger robot: one warning lists all that is missing, and the rest is used."""
    semantics = arm(
        '<group name="whole"><joint name="elbow"/><joint name="shoulde"/><group name="rf"/><link name="hand"/>'
        '<chain base_link="lamp" tip_link="hand"/></group>'
        '<group_state name="s" group="whole"><joint name="root_joint" value="0. 0. 1. 0. 0. 0. 1."/>'
        '<joint name="wrist" value="0 0 0 0 0 0 1"/><joint name="elbow" value="0.5"/></group_state>'
    )
    assert semantics.groups["whole"].joints == ("elbow",) and semantics.groups["whole"].links == ("fore", "hand")
    assert semantics.states == {"s": {"elbow": 0.5}}
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        (
            "WARNING",
            "arm.srdf: left out: "
            "group 'whole': unknown joint 'shoulde' (did you mean shoulder, pole?); "
            "group 'whole': unknown group 'rf'; "
            "group 'whole': no chain leads from link 'lamp' out to link 'hand'; "
            "group_state 's': joint 'root_joint' has 7 values, which place the robot in the world; "
            "group_state 's': joint 'wrist' has 7 values, which place the robot in the world",
        )
    ]


def test_several_values_of_a_moving_joint_are_refused():
    with pytest.raises(ModelError, match="value \"0 1\" of joint 'elbow'"):
        arm('<group name="a"/><group_state name="s" group="a"><joint name="elbow" value="0 1"/></group_state>')


def test_a_chain_may_end_in_a_part(centauro):
    text = '<robot name="c"><group name="a"><chain base_link="pelvis" tip_link="arm1_2"/></group></robot>'
    part = Description.from_text(cut(centauro, "arm1_2", "upper"), "arm")
    semantics = Semantics.from_text(text, part, others=(centauro,))
    assert semantics.groups["a"].joints == ("j_arm1_2",)


ELBOW = '<group_state name="{}" group="{}"><joint name="elbow" value="{}"/></group_state>'
OVERLAPPING = '<group name="arm"><joint name="elbow"/></group><group name="both"><group name="arm"/></group>'


def test_groups_that_overlap_may_have_states_of_one_name(caplog):
    assert arm(OVERLAPPING + ELBOW.format("ready", "arm", 0.5) + ELBOW.format("ready", "both", 0.5)).states == {
        "ready": {"elbow": 0.5}
    }
    shoulder = ELBOW.format("ready", "both", 0.7).replace("<joint", '<joint name="shoulder" value="1"/><joint')
    assert arm(OVERLAPPING + ELBOW.format("ready", "arm", 0.5) + shoulder).states == {
        "ready": {"elbow": 0.5, "shoulder": 1.0},
        "arm/ready": {"elbow": 0.5},
        "both/ready": {"elbow": 0.7, "shoulder": 1.0},
    }
    assert not caplog.messages


def test_elements_that_are_unknown_are_left_out(caplog):
    semantics = arm(
        '<group name="arm"><joint name="elbow"/><passive_joint name="elbow"/><frame name="hand"/></group>'
        '<disable_collision link1="hand" link2="fore"/><gripper name="g"><size value="1"/></gripper>'
        '<joint_property joint_name="elbow" property_name="angular_distance_weight" value="1"/>'
    )
    assert semantics.groups["arm"].joints == ("elbow",) and not semantics.apart
    (message,) = caplog.messages
    for part in ("<passive_joint>", "<frame>", "'disable_collision' (did you mean disable_collisions", "'gripper'"):
        assert part in message
    assert "unknown element 'joint_property'" not in message


def test_an_srdf_of_unknown_elements_alone_is_empty(caplog):
    assert not arm('<groups name="a"/>').groups
    assert caplog.messages == ["arm.srdf: left out: robot: unknown element 'groups' (did you mean group, group_state?)"]


def pairs(*names):
    return {frozenset(name.split()) for name in names}


@pytest.mark.parametrize(
    "content, apart",
    [
        ('<disable_default_collisions link="hand"/>', pairs("hand base", "hand upper", "hand fore", "hand lamp")),
        (
            '<disable_default_collisions link="hand"/><enable_collisions link1="base" link2="hand"/>',
            pairs("hand upper", "hand fore", "hand lamp"),
        ),
        (
            '<disable_collisions link1="hand" link2="base" reason="Never"/><disable_default_collisions link="hand"/>'
            '<enable_collisions link1="base" link2="hand"/><enable_collisions link1="lamp" link2="hand"/>',
            pairs("hand base", "hand upper", "hand fore"),
        ),
        ('<disable_default_collisions link="none"/><enable_collisions link1="base" link2="hand"/>', pairs()),
    ],
)
def test_collisions_that_do_not_count(content, apart):
    """What is disabled by name is stronger than what is enabled, and that is stronger than a default."""
    assert arm('<group name="a"><link name="hand"/></group>' + content).apart == apart


MOVEIT = """
  <group name="panda_arm"><chain base_link="panda_link0" tip_link="panda_link8"/></group>
  <group name="hand">
    <link name="panda_hand"/><link name="panda_leftfinger"/><link name="panda_rightfinger"/>
    <joint name="panda_finger_joint1"/><passive_joint name="panda_finger_joint2"/>
  </group>
  <group name="panda_manipulator"><chain base_link="panda_link0" tip_link="panda_hand_tcp"/></group>
  <group name="panda_arm_hand"><group name="panda_arm"/><group name="hand"/></group>
  <group_state name="ready" group="panda_arm">{ready}</group_state>
  <group_state name="ready" group="panda_manipulator">{ready}</group_state>
  <group_state name="open" group="hand">
    <joint name="panda_finger_joint1" value="0.035"/><joint name="panda_finger_joint2" value="0.035"/>
  </group_state>
  <end_effector name="hand" parent_link="panda_link8" group="hand" parent_group="panda_arm"/>
  <virtual_joint name="virtual_joint" type="floating" parent_frame="world" child_link="panda_link0"/>
  <passive_joint name="panda_finger_joint2"/>
  <disable_default_collisions link="panda_hand"/>
  <enable_collisions link1="panda_hand" link2="panda_link0"/>
  <disable_collisions link1="panda_link0" link2="panda_link1" reason="Adjacent"/>"""
"""Elements that MoveIt's own SRDFs of the Panda have."""


def test_an_srdf_as_moveit_writes_it(caplog):
    """Pinocchio counts the joints, as it reads the same URDF."""
    data = pytest.importorskip("pybullet_data")
    panda = Description.from_file(Path(data.getDataPath(), "franka_panda/panda.urdf"))
    angles = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
    ready = "".join(f'<joint name="panda_joint{i}" value="{angle}"/>' for i, angle in enumerate(angles, start=1))
    tip = MOVEIT.replace("panda_hand_tcp", "panda_grasptarget")  # PyBullet's name of the link
    semantics = Semantics.from_text(f'<robot name="panda">{tip.format(ready=ready)}</robot>', panda, "panda.srdf")
    assert list(semantics.groups) == ["panda_arm", "hand", "panda_manipulator", "panda_arm_hand"]
    assert len(semantics.groups["panda_arm"].joints) == 7
    assert semantics.groups["hand"].joints == ("panda_finger_joint1", "panda_finger_joint2")
    assert list(semantics.states["ready"].values()) == list(angles) and set(semantics.states) == {"ready", "open"}
    others = len(panda.links) - 2  # the hand itself, and the link whose collisions with it count
    assert len(semantics.apart) == others + 1
    (message,) = caplog.messages
    assert message == "panda.srdf: left out: group 'hand': unknown member <passive_joint>"

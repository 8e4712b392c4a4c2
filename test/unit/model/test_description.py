"""Reading a URDF: its content, and every way in which it can be wrong."""

import re

import numpy as np
import pinocchio
import pytest

from solfer.errors import ModelError, SolferError, SolferErrors, UnknownName
from solfer.model.kinematics import Kinematics
from solfer.model.urdf.description import Description
from solfer.model.urdf.elements import Mimic

LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="4"/>'


def joint(name, parent, child, kind="revolute", inside=LIMIT):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def robot(*elements, links="abc"):
    return '<robot name="arm">' + "".join(f'<link name="{link}"/>' for link in links) + "".join(elements) + "</robot>"


ARM = robot(
    '<link name="hand"><inertial><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><mass value="5"/>'
    '<inertia ixx="1" ixy="2" ixz="3" iyy="4" iyz="5" izz="6"/></inertial>'
    '<visual><geometry><box size="1 1 1"/></geometry></visual>'
    '<collision><geometry><sphere radius="1"/></geometry></collision></link>',
    joint("shoulder", "a", "b", inside='<origin xyz="0 0 1" rpy="0 0 0.5"/><axis xyz="0 0 2"/>' + LIMIT),
    joint("weld", "b", "c", "fixed", inside=""),
    joint("hand", "b", "hand", "continuous", inside=""),
)


def test_links_and_joints_are_read():
    arm = Description.from_text(ARM)
    assert (arm.name, arm.root, arm.floating, arm.text) == ("arm", "a", None, ARM)
    assert list(arm.links) == ["a", "b", "c", "hand"] and list(arm.joints) == ["shoulder", "weld", "hand"]
    hand = arm.links["hand"]
    assert (hand.mass, hand.com, hand.inertia, hand.inertia_rpy) == (5, (1, 2, 3), (1, 2, 3, 4, 5, 6), (0.1, 0.2, 0.3))
    assert [shape.tag for shape in hand.shapes] == ["visual", "collision"]
    shoulder = arm.joints["shoulder"]
    assert (shoulder.xyz, shoulder.rpy, shoulder.axis) == ((0, 0, 1), (0, 0, 0.5), (0, 0, 1))
    assert (shoulder.lower, shoulder.upper, shoulder.velocity, shoulder.effort) == (-1, 2, 3, 4)


def test_absent_values_have_the_defaults_of_urdf():
    arm = Description.from_text(ARM)
    empty, turning = arm.links["a"], arm.joints["hand"]
    assert (empty.mass, empty.com, empty.inertia, empty.shapes) == (None, None, None, ())
    assert (turning.lower, turning.upper, turning.velocity, turning.effort) == (None, None, None, None)
    assert (turning.xyz, turning.rpy, turning.axis) == ((0, 0, 0), (0, 0, 0), (1, 0, 0))


def test_the_tree_is_connected():
    arm = Description.from_text(ARM)
    assert arm.links["a"].parent is None and arm.links["hand"].parent == "hand"
    assert arm.links["b"].children == ("weld", "hand")
    assert arm.subtree("b") == ("b", "c", "hand")
    assert [moving.name for moving in arm.moving_joints] == ["shoulder", "hand"]


def test_link_and_joint_may_share_a_name():
    arm = Description.from_text(ARM)
    assert arm.link("hand").name == arm.joint("hand").name == "hand"


def test_a_floating_base_is_found():
    text = robot(joint("base", "a", "b", "floating", ""), joint("hip", "b", "c"))
    assert Description.from_text(text).floating.name == "base"


def test_limits_agree_with_pinocchio():
    """`lower` and `upper` default to zero there too."""
    text = robot(joint("j", "a", "b", inside='<limit velocity="3" effort="4" upper="1"/>'), links="ab")
    ours, model = Description.from_text(text).joints["j"], pinocchio.buildModelFromXML(text)
    theirs = [model.lowerPositionLimit, model.upperPositionLimit, model.velocityLimit, model.effortLimit]
    np.testing.assert_array_equal(np.ravel(theirs), [ours.lower, ours.upper, ours.velocity, ours.effort])


@pytest.mark.parametrize("ask", [Description.link, Description.joint, Description.subtree])
def test_an_unknown_name_comes_with_its_neighbours(ask):
    with pytest.raises(UnknownName, match="did you mean: hand") as caught:
        ask(Description.from_text(ARM, where="arm.urdf"), "hnad")
    assert caught.value.where == "arm.urdf"


WRONG = {
    "empty": ("", "empty", "x.urdf:1"),
    "not XML": ("<robot>\n<link></robot>", "not XML: mismatched tag", "x.urdf:2:9"),
    "not a robot": ("<sdf/>", "outermost element is <sdf>", "x.urdf"),
    "no name": ("<robot><link name='a'/></robot>", "no name", "x.urdf"),
    "no link": ("<robot name='r'/>", "no link", "x.urdf"),
    "link without name": ("<robot name='r'><link/></robot>", "<link> number 1 has no name", "x.urdf"),
    "two links of one name": (robot(links="aa"), "stands at two links", "x.urdf:1:35: link 'a'"),
    "two joints of one name": (
        robot(joint("j", "a", "b"), joint("j", "a", "c")),
        "two joints",
        "x.urdf:1:195: joint 'j'",
    ),
    "unknown parent": (robot(joint("j", "z", "b"), links="ab"), "unknown link 'z'", "x.urdf:1:51: joint 'j'"),
    "unknown child": (robot(joint("j", "a", "z"), links="a"), "unknown link 'z'", "x.urdf:1:35: joint 'j'"),
    "no parent": (
        robot("<joint name='j' type='fixed'><child link='b'/></joint>", links="ab"),
        "<parent> is missing",
        "x.urdf:1:51: joint 'j'",
    ),
    "two roots": (robot(joint("j", "a", "b")), "2 links have no parent: a, c", "x.urdf"),
    "loop": (robot(joint("j", "b", "c"), joint("k", "c", "b")), "loop through the links b, c", "x.urdf"),
    "two parents": (robot(joint("j", "a", "c"), joint("k", "b", "c")), "carry the link: j, k", "x.urdf:1:51: link 'c'"),
    "no type": (robot(joint("j", "a", "b", ""), links="ab"), "no type", "x.urdf:1:51: joint 'j'"),
    "unknown type": (
        robot(joint("j", "a", "b", "revolut"), links="ab"),
        "did you mean: revolute",
        "x.urdf:1:51: joint 'j'",
    ),
    "planar": (robot(joint("j", "a", "b", "planar"), links="ab"), "planar", "x.urdf:1:51: joint 'j'"),
    "no limit": (robot(joint("j", "a", "b", inside=""), links="ab"), "<limit> is missing", "x.urdf:1:51: joint 'j'"),
    "no effort": (
        robot(joint("j", "a", "b", inside='<limit velocity="1"/>'), links="ab"),
        "no 'effort'",
        "x.urdf:1:118: joint 'j'",
    ),
    "limits crossed": (
        robot(joint("j", "a", "b", "prismatic", LIMIT.replace("-1", "3")), links="ab"),
        "is above",
        "x.urdf:1:51: joint 'j'",
    ),
    "negative effort": (
        robot(joint("j", "a", "b", inside=LIMIT.replace("4", "-4")), links="ab"),
        "effort -4 is negat",
        "x.urdf:1:51: joint 'j'",
    ),
    "a word for a number": (
        robot(joint("j", "a", "b", inside=LIMIT.replace("2", "two")), links="ab"),
        'upper="two"',
        "x.urdf:1:118: joint 'j'",
    ),
    "not finite": (
        robot(joint("j", "a", "b", inside=LIMIT.replace("2", "nan")), links="ab"),
        "a finite number",
        "x.urdf:1:118: joint 'j'",
    ),
    "two numbers of three": (
        robot(joint("j", "a", "b", inside='<origin xyz="0 0"/>' + LIMIT), links="ab"),
        "3 finite numbers",
        "x.urdf:1:118: joint 'j'",
    ),
    "zero axis": (
        robot(joint("j", "a", "b", inside='<axis xyz="0 0 0"/>' + LIMIT), links="ab"),
        "axis is zero",
        "x.urdf:1:51: joint 'j'",
    ),
    "negative mass": (
        '<robot name="r"><link name="a"><inertial><mass value="-1"/><inertia ixx="1" ixy="0" ixz="0" '
        'iyy="1" iyz="0" izz="1"/></inertial></link></robot>',
        "mass -1 kg is negative",
        "x.urdf:1:32: link 'a': inertial",
    ),
    "no inertia": (
        '<robot name="r"><link name="a"><inertial><mass value="1"/></inertial></link></robot>',
        "<inertia> is missing",
        "x.urdf:1:32: link 'a': inertial",
    ),
    "two floating joints": (
        robot(joint("j", "a", "b", "floating", ""), joint("k", "a", "c", "floating", "")),
        "2 floating joints",
        "x.urdf",
    ),
    "floating hand": (
        robot(joint("j", "a", "b"), joint("k", "b", "c", "floating", "")),
        "moving joint 'j'",
        "x.urdf:1:195: joint 'k'",
    ),
}


@pytest.mark.parametrize("fault", WRONG)
def test_a_wrong_urdf_gives_one_placed_error(fault):
    text, what, where = WRONG[fault]
    with pytest.raises(SolferError) as caught:
        Description.from_text(text, where="x.urdf")
    assert not isinstance(caught.value, SolferErrors), caught.value
    assert what in str(caught.value) and caught.value.where.startswith(where)


def test_all_faults_are_reported_at_once():
    text = robot(joint("j", "a", "b", inside=""), joint("k", "a", "z", "wheel"))
    with pytest.raises(SolferErrors) as caught:
        Description.from_text(text)
    assert len(caught.value.errors) == 3
    places = {error.where for error in caught.value.errors}
    assert places == {"URDF:1:67: joint 'j'", "URDF:1:142: joint 'k'"}


@pytest.mark.parametrize(
    ("shape", "what", "expected"),
    [
        ('<origin xyz="0 0"/><geometry><sphere radius="1"/></geometry>', 'origin xyz="0 0"', "3 finite numbers"),
        (
            '<origin rpy="0 nan 0"/><geometry><sphere radius="1"/></geometry>',
            'origin rpy="0 nan 0"',
            "3 finite numbers",
        ),
        ('<geometry><box size="1 1 0"/></geometry>', 'box size="1 1 0"', "3 finite numbers above 0"),
        ('<geometry><box size="1 inf 1"/></geometry>', 'box size="1 inf 1"', "3 finite numbers above 0"),
        ("<geometry><box/></geometry>", "<box> has no 'size'", ""),
        ('<geometry><sphere radius="-1"/></geometry>', 'sphere radius="-1"', "a finite number above 0"),
        ('<geometry><cylinder radius="one" length="1"/></geometry>', 'radius="one"', "a finite number above 0"),
        ('<geometry><capsule radius="1" length="nan"/></geometry>', 'length="nan"', "a finite number above 0"),
        ('<geometry><mesh filename="a.stl" scale="1 1"/></geometry>', 'scale="1 1"', "3 finite numbers"),
    ],
)
def test_a_wrong_shape_gives_one_placed_error(shape, what, expected):
    text = f"<robot name='r'>\n<link name='a'>\n<collision>\n{shape}</collision></link></robot>"
    with pytest.raises(ModelError) as caught:
        Description.from_text(text, where="x.urdf")
    assert what in caught.value.what and caught.value.expected == expected
    assert re.fullmatch(r"x\.urdf:4:\d+: link 'a': collision", caught.value.where)


def test_what_is_only_seen_may_be_flat():
    text = "<robot name='r'><link name='a'><visual><geometry><box size='1 1 0'/></geometry></visual></link></robot>"
    assert Description.from_text(text).links["a"].visuals
    with pytest.raises(ModelError, match="3 finite numbers"):
        Description.from_text(text.replace("1 1 0", "1 1 nan"))


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(ModelError, match="No such file") as caught:
        Description.from_file(tmp_path / "none.urdf")
    assert caught.value.where == str(tmp_path / "none.urdf")
    (tmp_path / "binary.urdf").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ModelError, match="UTF-8"):
        Description.from_file(tmp_path / "binary.urdf")


def test_a_file_in_latin_1(tmp_path, caplog):
    text = '<?xml version="1.0"{}?>\n<!-- é --><robot name="r"><link name="é"/></robot>'
    (tmp_path / "r.urdf").write_bytes(text.format(' encoding="iso-8859-1"').encode("latin-1"))
    assert Description.from_file(tmp_path / "r.urdf").root == "é" and not caplog.messages
    (tmp_path / "r.urdf").write_bytes(text.format("").encode("latin-1"))
    assert Description.from_file(tmp_path / "r.urdf").root == "é" and "Latin-1" in caplog.text
    (tmp_path / "r.urdf").write_bytes(b"\xef\xbb\xbf" + text.format("").encode())
    assert Description.from_file(tmp_path / "r.urdf").root == "é"


TOLERATED = {
    "comment with hyphens": ("<!-- ---- arm ---- -->\n", "", "r.urdf:2:"),
    "comment that ends with a hyphen": ("<!-- arm --->", "", "r.urdf:2:"),
    "ampersand": ("<gazebo><name>R&D</name></gazebo>", "", "r.urdf:2:"),
    "second end": ("", "\n</robot>", "r.urdf:3:"),
    "element behind": ("", "<robot/>", "r.urdf:2:"),
}


@pytest.mark.parametrize("inside, behind, place", TOLERATED.values(), ids=TOLERATED)
def test_what_other_parsers_tolerate_is_read_with_a_warning(inside, behind, place, caplog):
    text = (
        '<robot name="r">\n' + inside + '<link name="a"/><link name="b"/>' + joint("j", "a", "b") + "</robot>" + behind
    )
    description = Description.from_text(text, "r.urdf")
    assert list(description.joints) == ["j"] and description.joints["j"].where.startswith("r.urdf:")
    (message,) = caplog.messages
    assert message.startswith(place) and "not XML" in message
    assert pinocchio.buildModelFromXML(text).nq == 1
    assert Kinematics(description).dofs == ("j",)


@pytest.mark.parametrize(
    "namespace, inside",
    [
        (' xmlns="http://www.ros.org"', ""),
        (' xmlns:xacro="http://www.ros.org/wiki/xacro"', ""),
        ("", '<gazebo reference="b"><probe:eye name="e"><probe:rate>10</probe:rate></probe:eye></gazebo>'),
        ("", '<link name="c" probe:kind="x"/><joint name="w" type="fixed"><parent link="b"/><child link="c"/></joint>'),
    ],
)
def test_namespaces_mean_nothing(namespace, inside, caplog):
    text = f'<robot name="r"{namespace}><link name="a"/><link name="b"/>{joint("j", "a", "b")}{inside}</robot>'
    description = Description.from_text(text)
    floating = description.with_base(True)
    assert not caplog.messages
    assert pinocchio.buildModelFromXML(text).nq == len(description.moving_joints) == len(floating.moving_joints) == 1
    assert Kinematics(floating).size == 7


XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><!-- <xacro:no/> -->{}<link name="a"/></robot>'


def test_what_is_written_for_xacro_says_how_it_is_expanded(tmp_path, monkeypatch):
    text = XACRO.format('\n<xacro:arm side="left"/>')
    with pytest.raises(ModelError, match=r"written for xacro: <xacro:arm>") as caught:
        Description.from_text(text, "r.urdf")
    assert caught.value.where == "r.urdf:2:1" and "xacro FILE > robot.urdf" in caught.value.expected
    (tmp_path / "r.urdf").write_text(text)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ModelError, match="xacro, which is not installed") as caught:
        Description.from_file(tmp_path / "r.urdf")
    assert f"xacro {tmp_path}/r.urdf > robot.urdf" in caught.value.expected


def test_a_file_is_expanded_by_the_program_xacro(tmp_path, monkeypatch):
    (tmp_path / "r.urdf").write_text(XACRO.format("<xacro:link/>"))
    (tmp_path / "xacro").write_text('#!/bin/sh\nsed "s/<xacro:link/<gazebo/" "$1"\n')
    (tmp_path / "xacro").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    assert Description.from_file(tmp_path / "r.urdf").root == "a"
    (tmp_path / "xacro").write_text("#!/bin/sh\necho no such macro >&2\nexit 2\n")
    with pytest.raises(ModelError, match="cannot expand the URDF: no such macro"):
        Description.from_file(tmp_path / "r.urdf")


def test_blank_lines_before_the_declaration_are_skipped(caplog):
    text = '\n \n<?xml version="1.0"?>\n<robot name="r">\n<link name="a"/>'
    assert Description.from_text(text + "</robot>", "r.urdf").root == "a"
    assert caplog.messages == ["r.urdf:1:1: blank before the XML declaration is skipped"]
    with pytest.raises(ModelError, match=r"r\.urdf:6:1: not XML"):
        Description.from_text(text + "\n<", "r.urdf")


def test_the_first_of_two_axes_counts(caplog):
    inside = '<axis xyz="0 0 1"/><axis xyz="1 0 0"/>' + LIMIT
    description = Description.from_text(robot(joint("j", "a", "b", inside=inside), links="ab"), "r.urdf")
    assert description.joints["j"].axis == (0, 0, 1)
    np.testing.assert_array_equal(Kinematics(description).jacobian("b").ravel()[3:], (0, 0, 1))
    assert caplog.messages == ["r.urdf:1:51: joint 'j': 2 elements <axis>, of which the first counts"]


def test_chains_of_mimic_joints_end_at_their_leader():
    second = joint("k", "b", "c", inside=LIMIT + "<mimic joint='j' multiplier='-2' offset='0.5'/>")
    third = joint("l", "c", "d", inside=LIMIT + "<mimic joint='k' multiplier='3'/>")
    description = Description.from_text(robot(joint("j", "a", "b"), second, third, links="abcd"), "x.urdf")
    assert Kinematics(description).dofs == ("j", "k", "l")
    assert description.mimics == {"k": Mimic("j", -2.0, 0.5), "l": Mimic("j", -6.0, 1.5)}


def test_a_leader_that_is_missing_frees_the_joint(caplog):
    second = joint("k", "b", "c", inside=LIMIT + "<mimic joint='jj'/>")
    third = joint("l", "c", "d", inside=LIMIT + "<mimic joint='k' multiplier='3'/>")
    description = Description.from_text(robot(joint("j", "a", "b"), second, third, links="abcd"), "x.urdf")
    assert description.mimics == {"l": Mimic("k", 3.0, 0.0)}
    assert caplog.messages == ["x.urdf:1:211: joint 'k' follows 'jj', which is no joint here: it moves on its own"]


@pytest.mark.parametrize(
    "mimic, words",
    [
        ("<mimic joint='k'/>", "the joint follows itself: k, k"),
        ("<mimic/>", "<mimic> has no 'joint'"),
        ("<mimic joint='j' multiplier='two'/>", 'mimic multiplier="two"'),
        ("<mimic joint='j' offset='nan'/>", 'mimic offset="nan"'),
        ("<mimic joint='f'/>", "follows 'f', which does not move"),
    ],
)
def test_mimic_joints_need_a_leader(mimic, words):
    fixed = "<joint name='f' type='fixed'><parent link='a'/><child link='d'/></joint>"
    text = robot(joint("j", "a", "b"), joint("k", "b", "c", inside=LIMIT + mimic), fixed, links="abcd")
    with pytest.raises(SolferError, match=words) as error:
        Description.from_text(text, "x.urdf")
    assert re.fullmatch(r"x\.urdf:1:\d+: joint 'k'", error.value.where)


@pytest.mark.parametrize("content", ["", "<cone radius='1'/>", "<sphere radius='1'/><sphere radius='2'/>"])
def test_a_collision_shape_is_one_that_is_known(content):
    link = f"<link name='a'><collision><geometry>{content}</geometry></collision></link>"
    with pytest.raises(ModelError, match="<geometry> has") as caught:
        Description.from_text(f'<robot name="r">{link}</robot>', "r.urdf")
    assert caught.value.where.endswith("link 'a': collision")


@pytest.mark.parametrize("limits", ["", 'lower="0" upper="0" '])
@pytest.mark.parametrize("ratio, offset", [(-1.0, 0.0), (0.5, 0.1)])
def test_a_follower_without_a_range_does_not_lock_its_leader(limits, ratio, offset):
    inside = f'<limit {limits}velocity="3" effort="4"/><mimic joint="lead" multiplier="{ratio}" offset="{offset}"/>'
    pincer = robot(joint("lead", "a", "b"), joint("follow", "a", "c", inside=inside))
    kinematics = Kinematics(Description.from_text(pincer))
    lead = kinematics.dofs.index("lead")
    assert (kinematics.lower_position[lead], kinematics.upper_position[lead]) == (-1, 2)


def test_dynamics_of_joints():
    inside = LIMIT + '<dynamics damping="0.2" friction="3"/>'
    arm = Description.from_text(robot(joint("j", "a", "b", inside=inside), joint("k", "b", "c")))
    assert [(each.damping, each.friction) for each in arm.joints.values()] == [(0.2, 3.0), (0.0, 0.0)]
    with pytest.raises(ModelError, match="dynamics friction -3 is negative"):
        Description.from_text(
            robot(joint("j", "a", "b", inside=inside.replace('friction="3', 'friction="-3')), links="ab")
        )

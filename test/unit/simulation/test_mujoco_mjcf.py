"""A robot of an MJCF: what its URDF says is what MuJoCo computes of the MJCF; what a URDF lacks is named."""

import logging
from xml.etree import ElementTree

import numpy as np
import pinocchio
import pytest

from solfer.errors import SolferError
from solfer.model.srdf.semantics import Semantics
from solfer.model.urdf.description import Description
from solfer.simulation.loading.meshes import TRIANGLE
from solfer.simulation.mujoco.library import load_mujoco
from solfer.simulation.mujoco.mjcf import convert_mjcf, is_mjcf

pytestmark = pytest.mark.needs("simulation")

SHELL = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
"""A mesh as OBJ, of one cubic metre by six."""

LEGS = """<mujocoinclude>
  <body name="left_thigh" pos="0 0.1 -0.05">
    <joint name="left_hip_roll" axis="1 0 0" range="-0.5 0.5"/>
    <joint name="left_hip_pitch" axis="0 1 0" range="-1 1.5" ref="0.2" pos="0.01 0 0.02" frictionloss="0.1"
      actuatorfrcrange="-40 30"/>
    <geom type="capsule" fromto="0 0 0 0 0 -0.25" size="0.04" mass="1"/>
    <body name="left_shin" pos="0 0 -0.25">
      <joint name="left_knee" axis="0 1 0" range="-2 0" pos="0 0 0.01"/>
      <geom type="cylinder" fromto="0 0 0 0 0 -0.2" size="0.03" mass="0.6"/>
      <body pos="0 0 -0.25"><geom type="box" size="0.1 0.08 0.02" mass="0.4"/></body>
    </body>
  </body>
  <body name="right_thigh" pos="0 -0.1 -0.05">
    <joint name="right_hip" axis="0 1 1" range="-1 1.5"/>
    <geom type="capsule" fromto="0 0 0 0 0 -0.25" size="0.04" mass="1"/>
    <body name="right_shin" pos="0 0 -0.25" childclass="slides">
      <joint name="right_slide" range="-0.1 0.1" ref="0.02"/>
      <geom type="box" size="0.1 0.08 0.02" pos="0 0 -0.25" mass="0.6"/>
    </body>
  </body>
</mujocoinclude>"""

WALKER = """<mujoco model="walker">
  <compiler angle="radian"/>
  <default>
    <joint damping="0.3" armature="0.02"/>
    <default class="seen"><geom contype="0" conaffinity="0" group="2"/></default>
    <default class="slides"><joint type="slide" axis="0 0 1" damping="20"/></default>
  </default>
  <asset>
    <mesh name="shell" file="shell.obj" scale="0.1 0.2 0.3"/>
    <material name="red" rgba="1 0 0 1"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="table" pos="3 0 0"><geom type="box" size="1 1 1"/></body>
    <body name="trunk" pos="0 0 0.6">
      <freejoint name="root"/>
      <geom type="box" size="0.1 0.1 0.05" mass="5"/>
      <geom name="skin" type="mesh" mesh="shell" class="seen" material="red" pos="0 0 0.1" mass="0.2"/>
      <include file="legs.xml"/>
      <body name="arm" pos="0 0 0.1" euler="0.3 1.5707963 0.2">
        <joint axis="0 0 1"/>
        <geom type="ellipsoid" size="0.05 0.02 0.03" euler="0.1 0.2 0.3" pos="0.02 0 0" mass="0.2"/>
        <body name="finger" pos="0.05 0 0" childclass="slides">
          <joint name="finger" axis="1 0 0" range="0 0.05"/><geom type="sphere" size="0.02" mass="0.02"/>
        </body>
        <body name="thumb" pos="0.05 0.1 0" childclass="slides">
          <joint name="thumb" axis="1 0 0" range="0 0.05"/><geom type="sphere" size="0.02" mass="0.02"/>
        </body>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="thumb" joint2="finger" polycoef="0.01 0.5 0 0 0"/></equality>
  <actuator>
    <motor joint="left_knee" gear="5" forcerange="-4 6"/>
    <position joint="left_hip_roll" kp="50"/>
    <motor joint="right_hip" gear="20" ctrlrange="-1 1"/>
  </actuator>
  <keyframe>
    <key name="squat" qpos="0 0 0.6 1 0 0 0  0 0.6 -0.5 0.2 0.02 0.1 0.01 0.015"/>
    <key name="home" qpos="0 0 0.6 1 0 0 0  0 0.2 0 0 0.02 0.1 0.01 0.015"/>
  </keyframe>
</mujoco>"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "shell.obj").write_text(SHELL)
    (tmp_path / "legs.xml").write_text(LEGS)
    (tmp_path / "walker.xml").write_text(WALKER)
    return tmp_path / "walker.xml"


def test_the_end_of_a_name_changes_nothing(file, made):
    assert convert_mjcf(file.rename(file.with_suffix(".mjcf")), "walker") == made


@pytest.fixture
def made(file):
    return convert_mjcf(file, "walker")


@pytest.fixture
def description(made):
    return Description.from_text(made["walker.urdf"].decode())


def test_masses_and_places_are_those_of_mujoco(file, made):
    """Mass, centre of mass, inertia matrix and all bodies at random postures, by MuJoCo and by Pinocchio.

    Velocities of a free joint are in the world's axes and in the body's in MuJoCo, in the body's alone in Pinocchio.
    """
    mujoco = load_mujoco()
    model = mujoco.MjModel.from_xml_path(str(file))
    model.dof_armature[:] = 0.0
    data = mujoco.MjData(model)
    robot = pinocchio.buildModelFromXML(made["walker.urdf"].decode())
    found = robot.createData()
    names = [model.joint(number).name or f"joint_{number}" for number in range(1, model.njnt)]
    bodies = [model.body(number).name or f"link_{number}" for number in range(2, model.nbody)]
    joints = [robot.joints[robot.getJointId(name)] for name in names]
    dofs = [*range(6), *(joint.idx_v for joint in joints)]
    rng = np.random.default_rng(1)
    for _ in range(3):
        base = pinocchio.SE3.Random()
        angles = rng.uniform(-1.0, 1.0, len(joints))
        data.qpos[:] = (*base.translation, *np.roll(pinocchio.Quaternion(base.rotation).coeffs(), 1), *angles)
        mujoco.mj_forward(model, data)
        position = pinocchio.neutral(robot)
        position[:7] = pinocchio.SE3ToXYZQUAT(robot.jointPlacements[1].inverse() * base)
        for joint, angle in zip(joints, angles, strict=True):
            position[joint.idx_q : joint.idx_q + joint.nq] = angle if joint.nq == 1 else (np.cos(angle), np.sin(angle))
        pinocchio.framesForwardKinematics(robot, found, position)
        for number, name in enumerate(bodies, start=2):
            place = found.oMf[robot.getFrameId(name, pinocchio.FrameType.BODY)]
            np.testing.assert_allclose(place.translation, data.xpos[number], rtol=0.0, atol=1e-9)
            np.testing.assert_allclose(place.rotation.ravel(), data.xmat[number], rtol=0.0, atol=1e-9)
        centre = pinocchio.centerOfMass(robot, found, position)
        masses = model.body_mass.copy()
        masses[: model.body("trunk").id] = 0.0
        np.testing.assert_allclose(centre, masses @ data.xipos / masses.sum(), rtol=0.0, atol=1e-6)
        assert found.mass[0] == pytest.approx(masses.sum(), abs=1e-6)
        inertia = pinocchio.crba(robot, found, position)
        inertia = (np.triu(inertia) + np.triu(inertia, 1).T)[np.ix_(dofs, dofs)]
        expected = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, expected)
        turn = np.eye(model.nv)
        turn[:3, :3] = base.rotation
        np.testing.assert_allclose(inertia, turn.T @ expected @ turn, rtol=0.0, atol=1e-6)


def test_joints_are_those_of_the_mjcf(description):
    joints = description.joints
    assert {name: joint.type for name, joint in joints.items() if joint.type != "fixed"} == {
        "root": "floating",
        "left_hip_roll": "revolute",
        "left_hip_pitch": "revolute",
        "left_knee": "revolute",
        "right_hip": "revolute",
        "right_slide": "prismatic",
        "joint_6": "continuous",
        "finger": "prismatic",
        "thumb": "prismatic",
    }
    assert (joints["left_hip_pitch"].lower, joints["left_hip_pitch"].upper) == (-1.0, 1.5)
    assert (joints["right_slide"].lower, joints["right_slide"].upper) == (-0.1, 0.1)
    efforts = {"left_hip_roll": 100.0, "left_hip_pitch": 40.0, "left_knee": 30.0, "right_hip": 20.0}
    assert {name: joints[name].effort for name in efforts} == efforts
    assert (joints["left_hip_pitch"].damping, joints["left_hip_pitch"].friction) == (0.3, 0.1)
    assert (joints["right_slide"].damping, joints["right_slide"].velocity) == (20.0, 1.0)
    assert (joints["thumb"].mimic.joint, joints["thumb"].mimic.multiplier) == ("finger", 0.5)
    assert joints["thumb"].mimic.offset == 0.01


def test_shapes_are_those_of_the_geoms(description, made):
    def of(link, tag):
        return [next(iter(shape.find("geometry"))).tag for shape in getattr(description.link(link), tag)]

    assert of("left_thigh", "collisions") == ["cylinder", "sphere", "sphere"] == of("left_thigh", "visuals")
    assert (of("trunk", "collisions"), of("trunk", "visuals")) == (["box"], ["box", "mesh"])
    assert description.link("trunk").visuals[1].find("material/color").get("rgba") == "1.0 0.0 0.0 1.0"
    assert description.link("arm").collisions[0].find("geometry/mesh").get("scale") == "0.05 0.02 0.03"
    skin = description.link("trunk").visuals[1].find("origin")
    place = pinocchio.SE3(
        pinocchio.rpy.rpyToMatrix(np.array(skin.get("rpy").split(), float)), np.array(skin.get("xyz").split(), float)
    )
    corners = np.frombuffer(made["meshes/shell.stl"][84:], dtype=TRIANGLE)["corners"].reshape(-1, 3)
    corners = np.unique(np.round(corners @ place.rotation.T + place.translation, 6) + 0.0, axis=0)
    np.testing.assert_allclose(corners, [(0.0, 0.0, 0.1), (0.0, 0.0, 0.4), (0.0, 0.2, 0.1), (0.1, 0.0, 0.1)])


def test_keyframes_are_states_home_first(made):
    states = ElementTree.fromstring(made["walker.srdf"]).findall("group_state")
    assert [state.get("name") for state in states] == ["home", "squat"]
    values = {joint.get("name"): float(joint.get("value")) for joint in states[1]}
    assert values["left_hip_pitch"] == 0.6 and values["finger"] == 0.01 and "thumb" not in values


def test_warnings_name_what_the_urdf_lacks(made, caplog):
    expected = (
        "MJCF has no velocity limits, so that 10 rad/s or 1 m/s counts until you correct them: left_hip_roll, left_",
        "no effort limit, so that 100 Nm or N counts until you correct it: left_hip_roll, right_slide, joint_6, finger",
        "with `reflect_inertia: true`: left_hip_roll 0.02, left_hip_pitch 0.02, left_knee 0.02, right_hip 0.02, right_",
        "a world of solfer has grounds and boxes: table, geom floor",
    )
    messages = [record.getMessage() for record in caplog.get_records("setup")]
    assert len(messages) == len(expected)
    for message, part in zip(messages, expected, strict=True):
        assert part in message


ARM = """<mujoco>
  <worldbody>
    <body name="arm"><joint name="elbow"/><geom size="0.1"/><site name="tip"/>
      <body name="hand"><joint name="wrist"/><geom size="0.1"/>{body}</body>
    </body>
    {world}
  </worldbody>
  {more}
</mujoco>"""


def arm(folder, body="", world="", more=""):
    file = folder / "arm.xml"
    file.write_text(ARM.format(body=body, world=world, more=more))
    return file


TENDON = '<tendon><fixed name="cable"><joint joint="elbow" coef="1"/></fixed></tendon>'
SURFACE = '<asset><hfield name="hill" nrow="2" ncol="2" size="1 1 1 1" elevation="0 1 0 1"/></asset>'
CURVED = '<equality><joint name="cam" joint1="elbow" joint2="wrist" polycoef="0 1 1 0 0"/></equality>'


@pytest.mark.parametrize(
    "part, message",
    [
        ({"more": TENDON}, "tendons are left out: couple their joints by equalities of joints: cable"),
        ({"more": CURVED}, "arm.xml:8:13)"),
        (
            {"more": '<equality><weld name="loop" body1="hand"/></equality>'},
            "that they hold: loop of hand and world (/",
        ),
        (
            {"more": '<equality><connect body1="hand" anchor="0 0 0"/></equality>'},
            "that they hold: number 0 of hand and world",
        ),
        ({"more": '<actuator><muscle name="biceps" joint="elbow" lengthrange="0 1"/></actuator>'}, "motors: biceps"),
        ({"more": '<actuator><motor name="jet" site="tip"/></actuator>'}, "their joints get motors: jet"),
        ({"body": '<body><joint stiffness="2"/><geom size="1"/></body>'}, "to the actuators' file: joint_2"),
        ({"body": '<body><joint name="hip" damping="1 2"/><geom size="1"/></body>'}, "rest: hip ({file}:4:70)"),
        ({"body": '<body name="head" gravcomp="1"><geom size="1"/></body>'}, "the weight: head ({file}:4:64)"),
        ({"more": '<contact><exclude body1="world" body2="arm"/></contact>'}, "say: world arm ({file}:8:12)"),
        ({"more": '<actuator><motor name="m" joint="elbow" damping="3"/></actuator>'}, "joints: m ({file}:8:13)"),
        ({"body": '<body><joint type="slide"/><geom size="1"/></body>'}, "range, so that 1000 m counts: joint_2"),
        ({"more": SURFACE, "body": '<geom type="hfield" hfield="hill"/>'}, "or meshes: number 2"),
    ],
)
def test_what_a_urdf_lacks_is_a_warning(part, message, tmp_path, caplog):
    file = arm(tmp_path, **part)
    with caplog.at_level(logging.WARNING):
        made = convert_mjcf(file, "arm")
    assert message.format(file=file) in caplog.text
    assert Description.from_text(made["arm.urdf"].decode()).root == "world"


def test_bodies_that_do_not_touch_are_those_of_the_srdf(tmp_path):
    made = convert_mjcf(arm(tmp_path, more='<contact><exclude body1="hand" body2="arm"/></contact>'), "arm")
    description = Description.from_text(made["arm.urdf"].decode())
    semantics = Semantics.from_text(made["arm.srdf"].decode(), description, where="arm.srdf")
    assert semantics.apart == {frozenset(("arm", "hand"))}


GRID = '<flexcomp name="cloth" type="grid" count="3 3 1" spacing="1 1 1" dim="2" mass="1"/>'
LOOSE = '<body name="ball{}"><freejoint/><geom size="0.1"/></body>'


@pytest.mark.parametrize(
    "part, where, message",
    [
        ({"body": '<body><joint name="hip" type="ball"/><geom size="1"/></body>'}, ":4:70: joint 'hip'", "ball joints"),
        ({"world": LOOSE.format(1)}, ":3:5: body 'arm'", "the body moves beside the robot on 'ball1', whose base"),
        ({"world": GRID}, "", "flexible bodies are not supported: 'cloth'"),
        ({"more": "<option gravitee='1'/>"}, ":8", "MuJoCo cannot read the MJCF: XML Error: Schema violation"),
        ({"more": "<option"}, "", "MuJoCo cannot read the MJCF: XML"),
    ],
)
def test_what_a_urdf_cannot_describe_is_an_error(part, where, message, tmp_path):
    file = arm(tmp_path, **part)
    with pytest.raises(SolferError) as caught:
        convert_mjcf(file, "arm")
    assert str(caught.value).startswith(f"{file}{where}") and message in str(caught.value)
    assert "expected: " in str(caught.value)


def test_a_file_without_joints_is_refused(tmp_path):
    (tmp_path / "box.xml").write_text("<mujoco><worldbody><body><geom size='1'/></body></worldbody></mujoco>")
    with pytest.raises(SolferError, match="no body has a joint"):
        convert_mjcf(tmp_path / "box.xml", "box")


@pytest.mark.parametrize("text, expected", [("<!-- a --><mujoco><a", True), ("<robot/>", False), ("", False)])
def test_an_mjcf_is_known_by_its_root(text, expected, tmp_path):
    (tmp_path / "a.xml").write_text(text)
    assert is_mjcf(tmp_path / "a.xml") is expected

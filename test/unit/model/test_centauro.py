"""CENTAURO's files: the numbers of the original program at one state, and facts about the real robot."""

import json
import math
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import SubElement

import numpy as np
import pinocchio
import pytest
import yaml
from numpy.testing import assert_allclose

from solfer.model.urdf.cut import cut
from solfer.model.urdf.description import Description

ROOT = Path(__file__).parents[3]
BUNDLE = ROOT / "config" / "robots" / "centauro"
POINTS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm1_7", "arm2_7", "pelvis", "torso_2")
CHART = ("x", "y", "z", "rx", "ry", "rz")


def pinocchio_model(urdf):
    """Build a model with one number per DoF: the floating joint becomes six joints, continuous ones have no limits."""
    robot = ElementTree.fromstring(urdf)
    limit = {"lower": "-1e9", "upper": "1e9", "velocity": "1e9", "effort": "1e9"}
    for joint in robot.findall("joint[@type='continuous']"):
        joint.set("type", "revolute")
        joint.find("limit").attrib.update(limit)
    floating = robot.find("joint[@type='floating']")
    robot.remove(floating)
    parent, child = floating.find("parent").get("link"), floating.find("child").get("link")
    for index, name in enumerate(CHART):
        joint = SubElement(robot, "joint", name=name, type="prismatic" if index < 3 else "revolute")
        if index == 0:
            joint.append(floating.find("origin"))
        below = child if index == 5 else f"below_{name}"
        if index < 5:
            SubElement(robot, "link", name=below)
        SubElement(joint, "parent", link=parent)
        SubElement(joint, "child", link=below)
        SubElement(joint, "axis", xyz=" ".join("1" if axis == index % 3 else "0" for axis in range(3)))
        SubElement(joint, "limit", limit)
        parent = below
    return pinocchio.buildModelFromXML(ElementTree.tostring(robot, encoding="unicode"))


def generate(folder, *options):
    return subprocess.run(
        [sys.executable, "-B", BUNDLE / "generate.py", "--output", folder, *options],
        capture_output=True,
        text=True,
        timeout=60,
    )


def states(srdf):
    """Return the values of every named state, by state and joint."""
    return {
        state.get("name"): {joint.get("name"): float(joint.get("value")) for joint in state}
        for state in ElementTree.parse(srdf).findall("group_state")
    }


@pytest.fixture(scope="module")
def centauro():
    return Description.from_file(BUNDLE / "centauro.urdf")


@pytest.fixture(scope="module")
def model(centauro):
    return pinocchio_model(centauro.text)


@pytest.fixture(scope="module")
def place(model):
    """Return a function for places of links [m] in `world`, with the pelvis at the floating joint's origin."""

    def _place(posture, *links):
        data, q = model.createData(), np.zeros(model.nq)
        for joint, value in posture.items():
            q[model.idx_qs[model.getJointId(joint)]] = value
        pinocchio.framesForwardKinematics(model, data, q)
        return [data.oMf[model.getFrameId(link, pinocchio.BODY)].copy() for link in links]

    return _place


@pytest.fixture(scope="module")
def original():
    """Read the results of the original C++ program at one state, with our names for the DoFs of the base."""
    values = json.loads((ROOT / "test" / "data" / "original_at_one_state.json").read_text())
    arrays = {key: np.array(value) for key, value in values.items() if key != "joints"}
    return arrays | {"joints": [*CHART, *values["joints"][6:]]}


@pytest.fixture(scope="module")
def ours(model, original):
    """Compute the same quantities from our URDF, in the original's order of DoFs."""
    order = [model.idx_vs[model.getJointId(name)] for name in original["joints"]]
    q, v = np.zeros(model.nq), np.zeros(model.nv)
    q[order], v[order] = original["q"], original["qd"]
    data = model.createData()
    pinocchio.computeAllTerms(model, data, q, v)
    pinocchio.updateFramePlacements(model, data)
    mass_matrix = np.triu(data.M) + np.triu(data.M, 1).T
    frames = [model.getFrameId(name, pinocchio.BODY) for name in POINTS]
    axes = pinocchio.LOCAL_WORLD_ALIGNED
    jacobian = np.vstack([pinocchio.getFrameJacobian(model, data, frame, axes)[:3, order] for frame in frames])
    return {
        "q": q,
        "P": np.concatenate([data.oMf[frame].translation for frame in frames]),
        "J": jacobian.ravel(),
        "com": data.com[0].copy(),
        "Jcom": data.Jcom[:, order].ravel(),
        "nle": data.nle[order],
        "M": mass_matrix[np.ix_(order, order)].ravel(),
        "mass": data.mass[0],
    }


@pytest.mark.parametrize("quantity", ["mass", "com", "Jcom", "P", "J", "M", "nle"])
def test_the_urdf_moves_like_the_original_robot(quantity, ours, original):
    assert_allclose(ours[quantity], original[quantity], rtol=0, atol=1e-9)


def test_links_joints_and_masses(centauro):
    assert (len(centauro.links), len(centauro.moving_joints)) == (57, 42)
    assert (centauro.root, centauro.floating.name, centauro.floating.xyz) == ("world", "reference", (0, 0, 0.93445))
    masses = [
        sum(link.mass or 0.0 for link in Description.from_text(text).links.values())
        for text in (centauro.text, cut(centauro, "torso_2", "upper"), cut(centauro, "torso_2", "lower"))
    ]
    assert_allclose(masses, [94.96909, 36.05099, 58.91809], atol=5e-6)


def test_every_shape_is_plain_urdf(centauro):
    shapes = [shape for link in centauro.links.values() for shape in link.shapes]
    assert {geometry.tag for shape in shapes for geometry in shape.find("geometry")} == {"box", "cylinder", "sphere"}


def test_the_driving_posture_stands_on_four_parallel_wheels(place):
    """Wheels turn forward for the signs (+, -, +, -): legs 2 and 4 have their axles the other way round."""
    posture = states(BUNDLE / "centauro.srdf")["mammal_wide_straight"]
    pelvis, *wheels = place(posture, "pelvis", "wheel_1", "wheel_2", "wheel_3", "wheel_4")
    centres = np.array([wheel.translation for wheel in wheels])
    assert_allclose(centres[:, 0], [0.546, 0.546, -0.546, -0.546], atol=5e-4)
    assert_allclose(centres[:, 1], [0.3185, -0.3185, 0.3185, -0.3185], atol=5e-4)
    assert_allclose(pelvis.translation[2] - centres[:, 2] + 0.078, 0.6307, atol=1e-4)
    axles = [wheel.rotation[:, 2] for wheel in wheels]
    assert_allclose(axles, [[0, 1, 0], [0, -1, 0], [0, 1, 0], [0, -1, 0]], atol=2e-3)


def test_the_srdf_names_only_what_exists(centauro):
    srdf = ElementTree.parse(BUNDLE / "centauro.srdf").getroot()
    groups = {group.get("name"): group for group in srdf.findall("group")}
    assert (len(groups), len(srdf.findall("group_state"))) == (29, 40)
    for group in groups.values():
        assert {member.get("name") for member in group.findall("group")} <= groups.keys()
        assert {member.get("name") for member in group.findall("link")} <= centauro.links.keys()
        for chain in group.findall("chain"):
            assert chain.get("tip_link") in centauro.subtree(chain.get("base_link"))
    moving = {joint.name for joint in centauro.moving_joints}
    assert all(state.keys() <= moving for state in states(BUNDLE / "centauro.srdf").values())


def test_states_within_the_limits(centauro, tmp_path):
    """The wide limits leave out three of the paper's states; the cautious ones leave out `home` as well."""

    def outside(description):
        return {
            name
            for name, state in states(BUNDLE / "centauro.srdf").items()
            for joint, value in state.items()
            if not description.joints[joint].lower <= value <= description.joints[joint].upper
        }

    assert outside(centauro) == {"upper_back", "spider", "hatch_whole"}
    assert generate(tmp_path, "--limits", "cautious").returncode == 0
    cautious = Description.from_file(tmp_path / "centauro.urdf")
    assert outside(cautious) > {"home", "spider", "narrow", "upper_back"}
    assert {cautious.joints[f"j_wheel_{leg}"].velocity for leg in range(1, 5)} == {1.0}


@pytest.mark.slow
def test_the_right_shoulder_may_mirror_the_left(place, tmp_path):
    left, right = place({}, "arm1_7", "arm2_7")
    assert left.translation[2] - right.translation[2] == pytest.approx(0.0215, abs=1e-4)
    assert generate(tmp_path, "--right-shoulder", "mirrored").returncode == 0
    mirrored = pinocchio_model((tmp_path / "centauro.urdf").read_text())
    data = mirrored.createData()
    pinocchio.framesForwardKinematics(mirrored, data, np.zeros(mirrored.nq))
    left, right = (data.oMf[mirrored.getFrameId(name, pinocchio.BODY)].translation for name in ("arm1_7", "arm2_7"))
    assert_allclose(right, left * [1, -1, 1], atol=1e-6)


def test_contacts_actuators_and_gains_fit_the_robot(centauro):
    """Four files describe one robot: names agree with the URDF, radii with its spheres, and numbers are finite."""
    load = {
        name: yaml.safe_load((BUNDLE / f"{name}.yaml").read_text())["centauro"][name]
        for name in ("contacts", "actuators", "gains")
    }
    moving = {joint.name for joint in centauro.moving_joints}
    assert load["actuators"].keys() == load["gains"].keys() == moving
    assert list(load["contacts"]) == [f"contact{number}" for number in range(6)]
    assert {contact["end_frame"] for contact in load["contacts"].values()} <= centauro.links.keys()
    radii = {
        contact["minor_axis"] + contact["major_axis"]
        for contact in load["contacts"].values()
        if contact["type"] == "wheel"
    }
    spheres = {
        float(sphere.get("radius"))
        for leg in range(1, 5)
        for shape in centauro.links[f"wheel_{leg}"].collisions
        for sphere in shape.iter("sphere")
    }
    assert {round(radius, 9) for radius in radii} == spheres == {0.078}
    numbers = [
        value
        for entry in (*load["actuators"].values(), *load["gains"].values())
        for value in entry.values()
        if value != "SEA"
    ]
    assert all(isinstance(value, float) and math.isfinite(value) and value >= 0.0 for value in numbers)


def test_the_entry_of_the_bundle_names_what_exists(centauro):
    entry = yaml.safe_load((BUNDLE / "robot.yaml").read_text())
    assert all((BUNDLE / entry[name]).is_file() for name in ("urdf", "srdf", "contacts", "actuators", "gains"))
    assert {part["at"] for part in entry["parts"].values()} <= centauro.links.keys()
    assert entry["start"]["state"] in states(BUNDLE / "centauro.srdf")


def test_the_files_are_what_the_generator_writes():
    done = generate(BUNDLE, "--check")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_generator_writes_the_hardware_gains(tmp_path):
    assert generate(tmp_path, "--gains", "hardware").returncode == 0
    assert (tmp_path / "gains.yaml").read_text() == (BUNDLE / "hardware" / "gains.yaml").read_text()


@pytest.mark.slow
def test_the_check_notices_a_change(tmp_path):
    assert generate(tmp_path).returncode == 0
    (tmp_path / "gains.yaml").write_text("changed by hand\n")
    done = generate(tmp_path, "--check")
    assert done.returncode == 1 and "gains.yaml" in done.stderr and "actuators.yaml" not in done.stderr

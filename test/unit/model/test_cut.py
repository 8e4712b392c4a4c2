"""Cutting a robot in two, by function and by command."""

import subprocess
import sys
from pathlib import Path

import pinocchio
import pytest

from solfer.errors import ModelError, UnknownName
from solfer.model.urdf.cut import cut
from solfer.model.urdf.description import Description
from solfer_tools.cli.main import main

CENTAURO = Path(__file__).parents[3] / "config" / "robots" / "centauro" / "centauro.urdf"

CRANE = """<robot name="crane">
  <material name="yellow"><color rgba="1 1 0 1"/></material>
  <link name="mast"><inertial><mass value="9"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><geometry><box size="1 1 4"/></geometry></visual></link>
  <link name="boom"/>
  <link name="hook"/>
  <joint name="slew" type="continuous"><parent link="mast"/><child link="boom"/></joint>
  <joint name="rope" type="fixed"><parent link="boom"/><child link="hook"/></joint>
  <gazebo reference="hook"/>
  <gazebo reference="mast"/>
  <gazebo><plugin name="clock"/></gazebo>
  <transmission name="slewing"><joint name="slew"/></transmission>
</robot>"""


@pytest.fixture(scope="module")
def centauro():
    return Description.from_file(CENTAURO)


def mass(text):
    return pinocchio.computeTotalMass(pinocchio.buildModelFromXML(text))


def test_the_upper_body_stands_on_a_massless_pelvis(centauro):
    text = cut(centauro, "torso_2", "upper")
    upper = Description.from_text(text)
    assert (upper.root, upper.floating, upper.links["pelvis"].mass, upper.links["pelvis"].shapes) == (
        "pelvis",
        None,
        None,
        (),
    )
    assert "reference" not in upper.joints and "neck_pitch" in upper.joints
    assert len(upper.moving_joints) == 18
    assert mass(text) == pytest.approx(36.05099, abs=5e-6)


def test_the_lower_body_keeps_its_floating_base(centauro):
    text = cut(centauro, "torso_2", "lower")
    lower = Description.from_text(text)
    assert (lower.root, lower.floating) == ("world", centauro.floating)
    assert len(lower.moving_joints) == 24 and "torso_yaw" not in lower.joints
    assert mass(text) == pytest.approx(58.91809, abs=5e-6)


def test_the_parts_together_are_the_robot(centauro):
    upper, lower = (Description.from_text(cut(centauro, "torso_2", keep)) for keep in ("upper", "lower"))
    assert upper.links.keys() | lower.links.keys() == centauro.links.keys()
    assert upper.links.keys() & lower.links.keys() == {"pelvis"}
    assert upper.joints | lower.joints == centauro.joints


def test_extensions_go_with_what_they_name():
    crane = Description.from_text(CRANE)
    upper, lower = cut(crane, "hook", "upper"), cut(crane, "hook", "lower")
    assert 'reference="hook"' in upper and 'reference="mast"' not in upper and "slewing" not in upper
    assert 'reference="hook"' not in lower and 'reference="mast"' in lower and "slewing" in lower
    for text in (upper, lower):
        assert "yellow" in text and "clock" in text


def test_a_link_that_cannot_be_cut():
    crane = Description.from_text(CRANE, where="crane.urdf")
    with pytest.raises(UnknownName, match="did you mean: boom"):
        cut(crane, "bom", "upper")
    with pytest.raises(ModelError, match="crane.urdf: link 'mast': no joint carries the root"):
        cut(crane, "mast", "upper")
    with pytest.raises(ModelError, match="expected: upper or lower"):
        cut(crane, "boom", "left")


def test_the_command_prints_the_urdf(centauro, capsys):
    assert main(["cut", str(CENTAURO), "--at", "torso_2", "--keep", "upper"]) == 0
    assert capsys.readouterr().out == cut(centauro, "torso_2", "upper")


def test_the_command_writes_a_file(centauro, tmp_path, capsys):
    target = tmp_path / "lower.urdf"
    assert main(["cut", str(CENTAURO), "--at", "torso_2", "--keep", "lower", "-o", str(target)]) == 0
    assert target.read_text() == cut(centauro, "torso_2", "lower") and capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([str(CENTAURO), "--at", "torso2", "--keep", "upper"], "did you mean: torso_2?"),
        (["none.urdf", "--at", "torso_2", "--keep", "upper"], "none.urdf: the URDF cannot be read"),
        ([str(CENTAURO), "--at", "torso_2", "--keep", "upper", "-o", "/none/of/these"], "cannot be written"),
    ],
)
def test_the_command_fails_in_one_block(arguments, message, capsys):
    assert main(["cut", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and message in err and "Traceback" not in err


@pytest.mark.parametrize("arguments", [[], ["cute"], ["cut", "x.urdf", "--at", "a", "--keep", "middle"]])
def test_a_wrong_call_shows_the_usage(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2 and "usage: solfer" in capsys.readouterr().err


def test_the_command_starts_without_the_heavy_libraries():
    """A launch file runs it for every part before anything else starts."""
    program = (
        "import sys; from solfer_tools.cli.main import main; "
        f"main(['cut', {str(CENTAURO)!r}, '--at', 'torso_2', '--keep', 'upper']); "
        "sys.exit(' '.join({'numpy', 'pinocchio', 'pydantic'} & sys.modules.keys()) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr

"""Warnings of `solfer check` about joints without a range and angles that look like degrees."""

import pytest

from solfer_tools.cli.main import main

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
LINKS = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in "abc")
URDF = f"""<robot name="cart"><link name="world"/>{LINKS}
<joint name="stuck" type="revolute"><parent link="world"/><child link="a"/>
  <limit lower="0" upper="0" velocity="1" effort="10"/></joint>
<joint name="elbow" type="revolute"><parent link="a"/><child link="b"/>
  <limit lower="-90" upper="1.5" velocity="1" effort="10"/></joint>
<joint name="long" type="prismatic"><parent link="b"/><child link="c"/>
  <limit lower="0" upper="20" velocity="1" effort="10"/></joint></robot>"""
SRDF = """<robot name="cart"><group name="arm"><joint name="elbow"/><joint name="long"/></group>
<group_state name="rest" group="arm"><joint name="elbow" value="-45"/><joint name="long" value="12"/></group_state>
<group_state name="up" group="arm"><joint name="elbow" value="1"/></group_state></robot>"""
TAGS = """      class: solfer.components.inverse_kinematics:InverseKinematics
      stack:
        tasks:
          posture: {point: posture, gain: 1, reference: {sine: {amplitude: {elbow: 20.0, long: 0.1}, period: 1}}}
        levels: [[posture]]
"""


@pytest.fixture
def configuration(tmp_path, monkeypatch):
    """Make the package of a robot whose files have one of each mistake, and several numbers that have none."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cart.urdf").write_text(URDF)
    (tmp_path / "cart.srdf").write_text(SRDF)
    assert main(["new", "robot", "cart", "--urdf", "cart.urdf", "--srdf", "cart.srdf"]) == 0
    return tmp_path / "cart/config/cart.yaml"


def test_what_can_hardly_be_meant_is_a_warning(configuration, capsys):
    """The expected places are counted in the texts above."""
    capsys.readouterr()
    assert main(["check", str(configuration)]) == 0
    out, err = capsys.readouterr()
    urdf, srdf = (configuration.parents[2] / f"cart.{kind}" for kind in ("urdf", "srdf"))
    column = SRDF.splitlines()[1].index("<joint") + 1
    assert err.splitlines() == [
        f"warning: {urdf}:2:1: joints with equal lower and upper limits, so that they are locked: stuck; "
        "correct their <limit>",
        f"warning: {urdf}:4:1: joint 'elbow' has a limit that looks like degrees: -90 rad is more than a turn, "
        "-90 degrees are -1.571 rad",
        f"warning: {srdf}:2:{column}: joint 'elbow' has a value in a state that looks like degrees: -45 rad is more "
        "than a turn, -45 degrees are -0.7854 rad",
    ]
    assert out.endswith("2 configurations, no errors, 3 warnings\n")


def test_links_without_mass_are_one_warning(configuration, capsys):
    """The simulation refuses them, in a check as well; a Robot needs none."""
    urdf = configuration.parents[2] / "cart.urdf"
    urdf.write_text(URDF.replace(INERTIAL, ""))
    capsys.readouterr()
    assert main(["check", str(configuration)]) == 2
    (found,) = [line for line in capsys.readouterr().err.splitlines() if "without mass" in line]
    assert found.startswith(f"warning: {urdf}:1:") and "without mass: a, b, c; give each an <inertial>" in found


def test_an_angle_in_a_tag_is_a_warning(configuration, capsys):
    text = configuration.read_text()
    place = text.index("      chain: all            # SRDF group of the joints")
    configuration.write_text(text[:place] + TAGS)
    main(["check", str(configuration)])
    line = next(number for number, line in enumerate(configuration.read_text().splitlines(), 1) if "amplitude" in line)
    column = TAGS.splitlines()[3].index("20.0") + 1
    lines = capsys.readouterr().err.splitlines()
    (found,) = [each for each in lines if each.startswith(f"warning: {configuration}:{line}:")]
    assert found.startswith(f"warning: {configuration}:{line}:{column}: ")
    assert found.endswith(
        "sine.amplitude.elbow: the angle looks like degrees: 20 rad is more than a turn, 20 degrees are 0.3491 rad"
    )


@pytest.mark.parametrize(
    "written, instead, words",
    [
        ('<mass value="1"/>', '<mass value="9000"/>', "link 'a' has a mass of 9000 kg: are these grams?"),
        ('<child link="b"/>', '<child link="b"/><origin xyz="0 0 300"/>', "'elbow' is 300 m from the one before"),
        ('lower="-90" upper="1.5" velocity="1"', 'lower="-1" upper="1" velocity="900"', "velocity limit of 900 rad/s"),
    ],
)
def test_a_robot_in_other_units_is_a_warning(written, instead, words, configuration, capsys):
    (configuration.parents[2] / "cart.urdf").write_text(URDF.replace(written, instead, 1))
    main(["check", str(configuration)])
    assert words in capsys.readouterr().err

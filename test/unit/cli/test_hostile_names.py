"""Names of links and files that look like YAML, XML, or words of the templates: files of a robot read as they are."""

import xml.etree.ElementTree as ElementTree
from xml.sax.saxutils import quoteattr

import pytest
import yaml
from support.robots import CENTAURO

from solfer_tools.cli.main import main
from solfer_tools.cli.skeletons.robot import RobotSkeleton

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
NAMES = [
    "x], y: {z",
    "a\nb: c",
    "true",
    "1.0",
    "../evil",
    "*x",
    "a'b\"c",
    "@FLOATING@",
    "{base}",
    "<a>&b",
    "a\u0085b",
    10_000 * "x",
]


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_files_of_a_robot_hold_any_name(tmp_path, name, floating):
    """Names with quotes, markup or line ends are quoted in each file that `solfer new robot` writes."""
    link = quoteattr(name, {"\n": "&#10;"})
    urdf = tmp_path / ("a 'b\" & #c.urdf" if len(name) < 100 else "long.urdf")
    urdf.write_text(
        f'<robot name={link}><link name="base">{INERTIAL}</link><link name={link}>{INERTIAL}</link>'
        f'<joint name={link} type="revolute"><origin xyz="0 0 -1"/><parent link="base"/><child link={link}/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    RobotSkeleton("good", tmp_path / "good", urdf, None, floating).write()
    assert {each.name for each in tmp_path.iterdir()} == {urdf.name, "good"}
    made = tmp_path / "good" / "config"
    tasks = yaml.safe_load((made / "good.yaml").read_text())["mwoibn"]["modules"]["inverse_kinematics"]["stack"][
        "tasks"
    ]
    assert tasks["feet"]["link"] == [name] if floating else tasks["tip"]["link"] == name
    bundle = made / "robots" / "good"
    robot = yaml.safe_load((bundle / "robot.yaml").read_text())
    assert (bundle / robot["urdf"]).resolve() == urdf and robot["floating_base"] is floating
    parameters = ElementTree.parse(tmp_path / "good" / "launch" / "good.launch").iter("param")
    assert any(each.get("textfile", "").endswith(urdf.name) for each in parameters)


@pytest.mark.parametrize(
    ("old", "new", "lines"),
    [
        ('value="0"', 'value="{{7*7}}"', 41),
        ("<group_state ", '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><group_state ', 2),
    ],
)
def test_a_wrong_srdf_leaves_no_package_and_few_lines(tmp_path, capsys, *, old, new, lines):
    """Each mistake once, at most 20 of them, and how many are more."""
    srdf = tmp_path / "wrong.srdf"
    srdf.write_text((CENTAURO / "centauro.srdf").read_text().replace(old, new))
    arguments = ["new", "robot", "good", "--urdf", str(CENTAURO / "centauro.urdf"), "--srdf", str(srdf)]
    assert main([*arguments, "--package", str(tmp_path / "good")]) == 2
    printed = capsys.readouterr().err.splitlines()
    assert len(printed) == lines and len(set(printed)) >= lines // 2
    assert all(str(srdf) in line for line in printed[::2][:20])
    assert not (tmp_path / "good").exists()

"""`solfer new`: the files that it makes, and what it refuses. The integration tests run them."""

from xml.etree import ElementTree

import pytest

from solfer.config import load
from solfer.simulation.bundle import read_bundle
from solfer_tools.cli.main import main


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_makes_a_catkin_package(folder, capsys):
    """Exactly these files, no placeholder left in any of them, and all XML and Python can be parsed."""
    assert main(["new", "component", "swing_joint"]) == 0
    made = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert made == {
        "swing_joint/CMakeLists.txt",
        "swing_joint/config/swing_joint.yaml",
        "swing_joint/config/swing_joint_rt.yaml",
        "swing_joint/launch/swing_joint.launch",
        "swing_joint/package.xml",
        "swing_joint/pytest.ini",
        "swing_joint/setup.py",
        "swing_joint/src/swing_joint/__init__.py",
        "swing_joint/src/swing_joint/swing_joint.py",
        "swing_joint/test/test_swing_joint.py",
    }
    assert "swing_joint.swing_joint:SwingJoint" in capsys.readouterr().out
    for path in made:
        text = (folder / path).read_text()
        assert "@" not in text.replace("@pytest", "").replace("you@example.org", ""), path
        if path.endswith((".xml", ".launch")):
            ElementTree.fromstring(text)
        elif path.endswith(".py"):
            compile(text, path, "exec")


def test_the_package_may_have_another_name(folder):
    assert main(["new", "component", "swing", "--package", "robots/my_robot"]) == 0
    configuration = load(folder / "robots/my_robot/config/swing.yaml", "swing")
    assert configuration.module.class_ == "my_robot.swing:Swing"
    package = ElementTree.parse(folder / "robots/my_robot/package.xml")
    assert package.findtext("name") == "my_robot"
    assert (folder / "robots/my_robot/src/my_robot/swing.py").is_file()


@pytest.mark.parametrize(
    "arguments",
    [
        ["Swing"],
        ["swing-joint"],
        ["1st"],
        ["class"],
        [""],
        ["../swing"],
        ["swing", "--package", "My-Package"],
    ],
)
def test_a_bad_name_is_refused(arguments, folder, capsys):
    assert main(["new", "component", *arguments]) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ") and "cannot be the name of a" in err and "expected: a small letter" in err
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("name", ["json", "numpy", "solfer"])
def test_the_name_of_a_python_module_is_refused(name, folder, capsys):
    assert main(["new", "component", name]) == 2
    assert f"there is a Python module '{name}' already" in capsys.readouterr().err
    assert list(folder.iterdir()) == []


def test_an_existing_folder_stays_as_it_is(folder, capsys):
    (folder / "swing").mkdir()
    assert main(["new", "component", "swing"]) == 2
    assert "swing: this exists already" in capsys.readouterr().err
    assert list((folder / "swing").iterdir()) == []


def test_an_impossible_folder_is_reported(folder, capsys):
    (folder / "file").write_text("")
    assert main(["new", "component", "swing", "--package", "file/swing"]) == 2
    assert "cannot be written" in capsys.readouterr().err


CART = """<robot name="cart"><link name="world"/>
  <link name="body"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="world"/><child link="body"/>
    <limit lower="-1" upper="1" velocity="1" effort="10"/></joint></robot>"""
GROUPS = '<robot name="cart"><group name="{name}"><joint name="{joint}"/></group></robot>'


@pytest.fixture
def urdf(folder):
    """Write a URDF and an SRDF into a folder beside that of the new package."""
    (folder / "given").mkdir()
    (folder / "given/cart.urdf").write_text(CART)
    (folder / "given/cart.srdf").write_text(GROUPS.format(name="all_of_it", joint="slide"))
    return "given/cart.urdf"


@pytest.mark.parametrize("srdf", ["", "given/cart.srdf"])
def test_it_makes_the_package_of_a_robot(urdf, srdf, folder, capsys):
    """Paths do not depend on this machine, the bundle loads, and `solfer check` finds no mistake in it."""
    given = ["--urdf", urdf, *(["--srdf", srdf] if srdf else [])]
    assert main(["new", "robot", "cart", *given, "--package", "robots/my_cart"]) == 0
    package = folder / "robots/my_cart"
    made = {str(path.relative_to(package)) for path in package.rglob("*") if path.is_file()}
    assert made == {
        "CMakeLists.txt",
        "config/cart.yaml",
        "config/robots/cart/robot.yaml",
        "launch/cart.launch",
        "package.xml",
        "test/test_cart.py",
    }
    for path in made:
        text = (package / path).read_text()
        assert "@" not in text.replace("@pytest", "").replace("you@example.org", ""), path
        assert str(folder) not in text, path
        if path.endswith((".xml", ".launch")):
            ElementTree.fromstring(text)
    bundle = read_bundle(package / "config/robots/cart/robot.yaml")
    assert bundle.urdf.location.read_text() == CART and bundle.floating_base is False
    assert (bundle.srdf is None) == (not srdf)
    assert "the robot cart of 1 DoFs" in capsys.readouterr().out
    assert main(["check", str(package / "config/cart.yaml")]) == 0
    assert capsys.readouterr().out.endswith("2 configurations, no errors, no warnings\n")


MASS = '<inertial>{}<mass value="9"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'


SHAPES = {
    "error: {}/given/cart.urdf: link 'world': the mesh 'none.stl' of a": '<mesh filename="none.stl"/>',
    "warning: cart/config/cart.yaml:9:5: mwoibn.robot.name: ": '<box size="0.1 0.1 0.1"/>',
}
"""What `solfer check` finds in a cart with its weight beside these shapes."""


@pytest.mark.parametrize("finding", SHAPES)
def test_the_simulation_is_tried(finding, urdf, folder, capsys, caplog):
    """By `new` and by `check`."""
    shape = f"<collision><geometry>{SHAPES[finding]}</geometry></collision>"
    mass = MASS.format('<origin xyz="0 1 1"/>')
    (folder / urdf).write_text(CART.replace('<link name="world"/>', f'<link name="world">{mass}{shape}</link>'))
    assert main(["new", "robot", "cart", "--urdf", urdf, "--floating-base"]) == 0
    assert "the simulation refuses this robot" in caplog.text or "the robot falls within 1 s" in caplog.text
    assert main(["check", "cart/config/cart.yaml"]) == (2 if finding.startswith("error") else 0)
    assert capsys.readouterr().err.startswith(finding.format(folder))


def test_a_robot_may_float(urdf, folder, capsys):
    given = folder / urdf
    arguments = ["new", "robot", "cart", "--urdf", urdf, "--floating-base"]
    assert main(arguments) == 2 and "links move and have no mass: world" in capsys.readouterr().err
    given.write_text(given.read_text().replace('<link name="world"/>', f'<link name="world">{MASS.format("")}</link>'))
    assert main(arguments) == 0
    assert read_bundle(folder / "cart/config/robots/cart/robot.yaml").floating_base is True


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["cart", "--urdf", "none.urdf"], "none.urdf: the URDF cannot be read"),
        (["cart", "--urdf", "given/cart.urdf", "--srdf", "none.srdf"], "none.srdf: the SRDF cannot be read"),
        (["cart", "--urdf", "given/cart.urdf", "--srdf", "given/other.srdf"], "did you mean: slide?"),
        (["centauro", "--urdf", "given/cart.urdf"], "'centauro' is a robot that solfer ships"),
        (["Cart", "--urdf", "given/cart.urdf"], "'Cart' cannot be the name of a robot"),
        (["given", "--urdf", "given/cart.urdf"], "given: this exists already"),
    ],
)
def test_a_robot_that_cannot_be_is_refused(arguments, message, urdf, folder, capsys):
    (folder / "given/other.srdf").write_text(GROUPS.format(name="all_of_it", joint="slid"))
    assert main(["new", "robot", *arguments]) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ") and message in err
    assert [path.name for path in folder.iterdir()] == ["given"]


@pytest.mark.parametrize(
    "arguments", [["new"], ["new", "component"], ["new", "plugin", "swing"], ["new", "robot", "cart"]]
)
def test_a_wrong_call_shows_the_usage(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2 and "usage: solfer new" in capsys.readouterr().err

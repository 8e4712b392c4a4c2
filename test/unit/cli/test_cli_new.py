"""`solfer new component`: the files that it makes, and what it refuses. The integration tests run them."""

from xml.etree import ElementTree

import pytest

from solfer.cli.main import main
from solfer.config import load


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_makes_a_catkin_package(folder, capsys):
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


@pytest.mark.parametrize("arguments", [["new"], ["new", "component"], ["new", "plugin", "swing"]])
def test_a_wrong_call_shows_the_usage(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2 and "usage: solfer new" in capsys.readouterr().err

"""`solfer new robot --from`: robots of collections, and of MJCF."""

import sys
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from support.needs import needs_bullet, pybullet_robot

from solfer.errors import MissingDependency
from solfer.simulation import Simulation
from solfer.simulation.bundle import read_bundle
from solfer.simulation.mujoco import load_mujoco
from solfer_tools.cli.main import main
from solfer_tools.cli.skeletons import collections


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@needs_bullet
@pytest.mark.parametrize(
    "name, path", [("kuka_iiwa/model", "kuka_iiwa/model.urdf"), ("xarm6_robot", "xarm/xarm6_robot.urdf")]
)
def test_a_robot_of_pybullet(name, path, folder):
    assert main(["new", "robot", "arm", "--from", f"pybullet_data:{name}"]) == 0
    urdf = read_bundle(folder / "arm/config/robots/arm/robot.yaml").urdf.location
    assert Path(urdf).samefile(pybullet_robot(path))


def test_a_robot_of_a_collection_with_packages(folder, monkeypatch, capsys):
    (folder / "robots/arm_description/urdf").mkdir(parents=True)
    source = pybullet_robot("xarm/xarm6_robot.urdf").read_text()
    (folder / "robots/arm_description/urdf/arm.urdf").write_text(source)
    monkeypatch.setattr(collections, "folder_of", lambda collection: folder / "robots")
    assert main(["new", "robot", "arm", "--from", "example-robot-data:arm"]) == 0
    assert "the robot arm of 6 DoFs" in capsys.readouterr().out


@needs_bullet
@pytest.mark.parametrize(
    "source, message",
    [
        ("pybullet:r2d2", "unknown collection of robots 'pybullet'\n  did you mean: pybullet_data?"),
        ("pybullet_data:r2d", "did you mean: r2d2"),
        ("pybullet_data:mug", "robots are called 'mug'\n  expected: "),
    ],
)
def test_a_robot_that_no_collection_has(source, message, capsys, folder):
    assert main(["new", "robot", "arm", "--from", source]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"error: --from {source}: ") and message in error
    assert not list(folder.iterdir())


BIPED = """<mujoco><worldbody><body name="trunk" pos="0 0 1"><freejoint/><geom type="box" size="0.1 0.2 0.1" mass="5"/>
  <body name="left" pos="0 0.1 0"><joint name="left_hip" axis="0 1 0" range="-1 1"/>
    <joint name="left_ankle" axis="1 0 0" range="-1 1" pos="0 0 -0.3"/>
    <geom type="box" size="0.15 0.08 0.02" pos="0 0 -0.4" mass="1"/></body>
  <body name="right" pos="0 -0.1 0"><joint name="right_hip" axis="0 1 0" range="-1 1"/>
    <geom type="box" size="0.15 0.08 0.02" pos="0 0 -0.4" mass="1"/></body></body></worldbody>
  <keyframe><key name="home" qpos="0 0 0 1 0 0 0 0.01 0 0.01"/></keyframe></mujoco>"""

DESCRIPTIONS = {
    "__init__": "",
    "arm_description": "URDF_PATH = {urdf!r}",
    "mujoco_description": "MJCF_PATH = {mjcf!r}",
    "far_description": "raise OSError('Cmd(git) failed\\nCould not resolve host: github.com')",
}


@pytest.mark.parametrize(
    "name, message",
    [
        ("arm_description", ""),
        ("mujoco_description", ""),
        (
            "far_description",
            "robot_descriptions cannot get the robot: Could not resolve host: github.com\n  expected: the",
        ),
        ("am_description", "did you mean: arm_description"),
    ],
)
def test_a_robot_of_robot_descriptions(name, message, folder, tmp_path_factory, monkeypatch, capsys):
    package = tmp_path_factory.mktemp("packages") / f"robot_descriptions_of_{name}"
    package.mkdir()
    urdf = str(pybullet_robot("xarm/xarm6_robot.urdf"))
    mjcf = package / "biped.xml"
    mjcf.write_text(BIPED)
    for module, text in DESCRIPTIONS.items():
        (package / f"{module}.py").write_text(text.format(urdf=urdf, mjcf=str(mjcf)))
    monkeypatch.syspath_prepend(str(package.parent))
    monkeypatch.setattr(collections, "DESCRIPTIONS_PACKAGE", package.name)
    monkeypatch.setattr(collections, "COLLECTIONS", (package.name,))
    assert main(["new", "robot", "arm", "--from", f"{package.name}:{name}"]) == (2 if message else 0)
    assert message in capsys.readouterr().err
    assert (folder / "arm").exists() == (not message)


@pytest.mark.parametrize("collection", ["example-robot-data", "pybullet_data", "robot_descriptions"])
def test_a_collection_that_is_not_installed(collection, monkeypatch):
    def no(*_):
        raise collections.PackageNotFoundError

    def nothing(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(collections, "distribution", no)
    monkeypatch.setattr(collections.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(collections.importlib, "import_module", nothing)
    with pytest.raises(MissingDependency, match=f"{collection} is not installed") as caught:
        collections.find_robot(f"{collection}:arm")
    assert caught.value.expected == f"{sys.executable} -m pip install {collection}"


@pytest.mark.needs("simulation")
@pytest.mark.parametrize("name", ["biped.xml", "biped.mjcf"])
def test_a_robot_of_an_mjcf(name, folder, capsys):
    """The package has the URDF, begins in the keyframe `home`, and `solfer check` finds nothing to say of it."""
    (folder / name).write_text(BIPED)
    assert main(["new", "robot", "biped", "--from", name]) == 0
    assert "the robot biped of 9 DoFs" in capsys.readouterr().out
    with closing(Simulation.from_file(folder / "biped/config/robots/biped/robot.yaml")) as simulation:
        np.testing.assert_allclose(simulation.q[6:], (0.01, 0.0, 0.01), atol=1e-3)
    assert main(["check", "biped/config/biped.yaml"]) == 0
    assert "no errors, no warnings" in capsys.readouterr().out


@pytest.mark.needs("simulation")
def test_an_srdf_replaces_the_keyframes_of_an_mjcf(folder, caplog):
    (folder / "biped.xml").write_text(BIPED)
    state = '<group_state name="low" group="g"><joint name="left_hip" value="0"/></group_state>'
    (folder / "own.srdf").write_text(f'<robot name="a"><group name="g"><joint name="left_hip"/></group>{state}</robot>')
    assert main(["new", "robot", "biped", "--from", "biped.xml", "--srdf", "own.srdf"]) == 0
    assert "its keyframes and excluded contacts are left out: --srdf has those" in caplog.text
    assert not list(folder.glob("biped/**/*.srdf"))


def test_an_mjcf_is_no_urdf(folder, capsys):
    (folder / "biped.xml").write_text(BIPED)
    assert main(["new", "robot", "biped", "--urdf", "biped.xml"]) == 2
    message = "error: --urdf biped.xml: the file is MJCF, not URDF\n  expected: --from biped.xml\n"
    assert capsys.readouterr().err == message


@pytest.fixture
def menagerie(tmp_path_factory, monkeypatch):
    """Make a cache of robot_descriptions: a robot with a second file, and a folder with two hands."""
    cache = tmp_path_factory.mktemp("cache")
    for name in ("maker_biped/biped", "maker_biped/biped_fast", "maker_biped/scene", "hand/left", "hand/right"):
        file = cache / f"mujoco_menagerie/{name}.xml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(BIPED)
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(cache))
    return cache / "mujoco_menagerie"


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("maker_biped", "maker_biped/biped.xml"),
        ("biped", "maker_biped/biped.xml"),
        ("biped_fast", "maker_biped/biped_fast.xml"),
        ("hand/left", "hand/left.xml"),
    ],
)
def test_a_robot_of_the_menagerie(name, file, menagerie):
    assert collections.find_robot(f"menagerie:{name}") == menagerie / file


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("maker_bipd", "unknown robot 'maker_bipd'\n  did you mean: maker_biped"),
        ("hand", "2 robots are called 'hand'\n  expected: hand/left, hand/right"),
    ],
)
def test_a_robot_that_the_menagerie_lacks(name, message, menagerie, capsys):
    assert main(["new", "robot", "a", "--from", f"menagerie:{name}"]) == 2
    assert f"error: --from menagerie:{name}: {message}" in capsys.readouterr().err


def test_a_menagerie_that_is_not_there(folder, monkeypatch, capsys):
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(folder))
    assert main(["new", "robot", "a", "--from", "menagerie:unitree_go2"]) == 2
    error = capsys.readouterr().err
    assert "MuJoCo's menagerie is not there" in error
    assert f"as mujoco_menagerie or {folder / 'mujoco_menagerie'}" in error


def test_a_urdf_that_is_called_xml(folder):
    source = pybullet_robot("xarm/xarm6_robot.urdf").read_text()
    (folder / "arm.xml").write_text(source)
    assert main(["new", "robot", "arm", "--from", "arm.xml"]) == 0
    assert Path(read_bundle(folder / "arm/config/robots/arm/robot.yaml").urdf.location).samefile(folder / "arm.xml")


def test_an_mjcf_without_mujoco(folder, monkeypatch, capsys):
    (folder / "biped.xml").write_text(BIPED)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    load_mujoco.cache_clear()
    assert main(["new", "robot", "biped", "--from", "biped.xml"]) == 2
    assert "the simulation needs MuJoCo\n  expected: " in capsys.readouterr().err
    assert not (folder / "biped").exists()
    load_mujoco.cache_clear()


@pytest.mark.parametrize("name", ["absent.xml", "absent.mjcf"])
def test_a_file_that_is_not_there(name, folder, capsys):
    assert main(["new", "robot", "arm", "--from", name]) == 2
    assert f"error: {name}: the URDF cannot be read: No such file" in capsys.readouterr().err

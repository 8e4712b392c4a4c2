"""`solfer new robot --from`: robots of collections."""

import sys
from pathlib import Path

import pybullet_data
import pytest

from solfer.errors import MissingDependency
from solfer.simulation.bundle import read_bundle
from solfer_tools.cli.main import main
from solfer_tools.cli.skeletons import collections


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "name, path", [("kuka_iiwa/model", "kuka_iiwa/model.urdf"), ("xarm6_robot", "xarm/xarm6_robot.urdf")]
)
def test_a_robot_of_pybullet(name, path, folder):
    assert main(["new", "robot", "arm", "--from", f"pybullet_data:{name}"]) == 0
    urdf = read_bundle(folder / "arm/config/robots/arm/robot.yaml").urdf.location
    assert Path(urdf).samefile(Path(pybullet_data.getDataPath(), path))


def test_a_robot_of_a_collection_with_packages(folder, monkeypatch, capsys):
    (folder / "robots/arm_description/urdf").mkdir(parents=True)
    source = Path(pybullet_data.getDataPath(), "xarm/xarm6_robot.urdf").read_text()
    (folder / "robots/arm_description/urdf/arm.urdf").write_text(source)
    monkeypatch.setattr(collections, "folder_of", lambda collection: folder / "robots")
    assert main(["new", "robot", "arm", "--from", "example-robot-data:arm"]) == 0
    assert "the robot arm of 6 DoFs" in capsys.readouterr().out


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


DESCRIPTIONS = {
    "__init__": "",
    "arm_description": "URDF_PATH = {urdf!r}",
    "mujoco_description": "MJCF_PATH = 'a.xml'",
    "far_description": "raise OSError('Cmd(git) failed\\nCould not resolve host: github.com')",
}


@pytest.mark.parametrize(
    "name, message",
    [
        ("arm_description", ""),
        ("mujoco_description", "the robot has no URDF"),
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
    urdf = str(Path(pybullet_data.getDataPath(), "xarm/xarm6_robot.urdf"))
    for module, text in DESCRIPTIONS.items():
        (package / f"{module}.py").write_text(text.format(urdf=urdf))
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
        collections.find_in_collection(f"{collection}:arm")
    assert caught.value.expected == f"{sys.executable} -m pip install {collection}"

"""Files of packages, and which of them a request from outside may name."""

import sys
from types import SimpleNamespace

import pytest

from solfer.config.yaml import packages
from solfer.config.yaml.folders import Folders
from solfer.config.yaml.packages import package_folder, shipped_folder, workspace_packages
from solfer.errors import ConfigError, MissingDependency, UnknownName


class NotFound(Exception):
    """Stands in for rospkg's error."""


@pytest.fixture
def ros(monkeypatch):
    """Let rospkg know some packages, each path of the workspace its own ones."""
    paths = {"/ros": {"roscpp": "/ros/roscpp"}, "/ws": {"solfer": "/ws/solfer", "arm": "/ws/arm"}, "/more": {"x": "/x"}}

    class RosPack:
        def __init__(self, ros_paths=None):
            self._known = {name: each for path in ros_paths or paths for name, each in paths[path].items()}

        def list(self):
            return list(self._known)

        def get_path(self, name):
            if name not in self._known:
                raise NotFound(name)
            return self._known[name]

    module = SimpleNamespace(RosPack=RosPack, ResourceNotFound=NotFound, get_ros_paths=lambda: list(paths))
    monkeypatch.setitem(sys.modules, "rospkg", module)
    return paths


def test_the_workspace_counts_more_than_the_code(ros):
    assert package_folder("solfer") == "/ws/solfer" and package_folder("arm") == "/ws/arm"
    assert workspace_packages() == {"solfer": "/ws/solfer", "arm": "/ws/arm"}
    with pytest.raises(UnknownName) as error:
        package_folder("amr", "arm.yaml:1:1")
    assert error.value.what == "unknown package 'amr'" and error.value.where == "arm.yaml:1:1"
    assert error.value.names == ("arm",)


def test_a_workspace_without_solfer_has_the_code(ros, repository):
    del ros["/ws"]["solfer"]
    assert shipped_folder() == repository
    assert package_folder("solfer") == str(repository) and workspace_packages() == {"solfer": str(repository)}


def test_without_ros_solfer_alone_is_there(monkeypatch, repository):
    monkeypatch.setitem(sys.modules, "rospkg", None)
    assert package_folder("solfer") == str(repository) and workspace_packages() == {"solfer": str(repository)}
    with pytest.raises(MissingDependency) as error:
        package_folder("arm", "arm.yaml:1:1")
    assert error.value.what == "package 'arm' is looked up with rospkg, which is not installed"
    assert error.value.where == "arm.yaml:1:1"
    assert error.value.expected == "ROS 1, or pip install rospkg and the package below a folder of ROS_PACKAGE_PATH"
    monkeypatch.setattr(packages, "shipped_folder", lambda: None)
    assert workspace_packages() == {}
    with pytest.raises(MissingDependency):
        package_folder("solfer")


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """Make a folder that is allowed, one beside it, and a package with a folder that is a link."""
    for name in ("open/deep", "shut", "package/config", "elsewhere"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "a.yaml").touch()
    (tmp_path / "open/link.yaml").symlink_to(tmp_path / "shut/a.yaml")
    (tmp_path / "package/linked").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "package/config/out.yaml").symlink_to(tmp_path / "shut/a.yaml")
    monkeypatch.setattr("solfer.config.yaml.folders.workspace_packages", lambda: {"arm": str(tmp_path / "package")})
    return tmp_path


@pytest.mark.parametrize(
    ("text", "file"),
    [
        ("{tree}/open/a.yaml", "open/a.yaml"),
        ("{tree}/open/deep/../none.yml", "open/none.yml"),
        ("{tree}/open/deep/a.yaml", "open/deep/a.yaml"),
        ("{tree}/open/a.txt", None),
        ("{tree}/open", None),
        ("{tree}/open/../shut/a.yaml", None),
        ("{tree}/open/link.yaml", None),
        ("{tree}/opener/a.yaml", None),
        ("{tree}/open/a\0.yaml", None),
        ("open/a.yaml", None),
        ("package://arm/config/a.yaml", "package/config/a.yaml"),
        ("package://arm//config//a.yaml", "package/config/a.yaml"),
        ("package://arm/linked/a.yaml", "elsewhere/a.yaml"),
        ("package://arm/config/out.yaml", None),
        ("package://arm/config/../../shut/a.yaml", None),
        ("package://arm/config/../../open/deep/a.yaml", "open/deep/a.yaml"),
        ("package://arm/../shut/a.yaml", None),
        ("package://arm/./a.yaml", None),
        ("package://arm/a.yaml", None),
        ("package://leg/config/a.yaml", None),
    ],
)
def test_no_request_leads_out_of_the_folders(tree, text, file):
    (tree / "open/a.yaml").touch()
    folders, text = Folders([tree / "open"]), text.format(tree=tree)
    if file is not None:
        assert folders.file(text) == (tree / file).resolve()
        return
    with pytest.raises(ConfigError) as error:
        folders.file(text)
    assert error.value.what == f"'{text}' is not a file that may be read"
    assert error.value.expected == (
        "a .yaml file below a folder that is allowed, or package://NAME/... of this workspace"
    )


@pytest.mark.parametrize("length", [4096, 4097])
def test_a_path_has_a_largest_length(tree, length):
    folders, text = Folders([tree / "open"]), f"{tree}/open/".ljust(length - 5, "/") + ".yaml"
    if length == 4096:
        assert folders.file(text) == tree / "open/.yaml"
    else:
        with pytest.raises(ConfigError) as error:
            folders.file(text)
        assert error.value.what == f"'{text[:200]}...' is not a file that may be read"


def test_only_folders_are_allowed(tree):
    folders = Folders()
    with pytest.raises(ConfigError) as error:
        folders.add(tree / "none", "arm.yaml:2:3")
    assert str(error.value) == f"arm.yaml:2:3: there is no folder '{tree / 'none'}'\n  expected: a folder"
    folders.add(tree / "shut")
    assert folders.file(f"{tree}/shut/a.yaml") == tree / "shut/a.yaml"

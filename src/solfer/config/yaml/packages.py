"""Folders of packages: ROS' own, and the one of solfer, which is there without ROS as well."""

import os
from pathlib import Path

from solfer.errors import MissingDependency, UnknownName

OWN_PACKAGE = "solfer"
"""The package that holds this code."""


def shipped_folder() -> Path | None:
    """Return the folder that holds `config/`: in what pip installed, or in the repository.

    None: this code lies in an install space of catkin, where only ROS knows the folder.
    """
    code = Path(__file__).resolve().parents[2]
    candidates = (code / "share", code.parents[1])
    return next((folder for folder in candidates if (folder / "config" / "robots").is_dir()), None)


def package_folder(name: str, where: str = "") -> str:
    """Return the folder of a package. The workspace's solfer counts more than the one beside this code.

    Args:
        name: The package.
        where: Place that named it, for errors.

    Raises:
        UnknownName: There is no such package.
        MissingDependency: It is not solfer, and ROS is not here.
    """
    own = shipped_folder() if name == OWN_PACKAGE else None
    try:
        import rospkg
    except ModuleNotFoundError as error:
        if own is not None:
            return os.fspath(own)
        raise MissingDependency(
            f"package '{name}' is looked up with rospkg, which is not installed",
            where=where,
            expected="ROS 1, or pip install rospkg and the package below a folder of ROS_PACKAGE_PATH",
        ) from error
    packages = rospkg.RosPack()
    try:
        return packages.get_path(name)
    except rospkg.ResourceNotFound as error:
        if own is not None:
            return os.fspath(own)
        raise UnknownName("package", name, packages.list(), where=where) from error


def workspace_packages() -> dict[str, str]:
    """Return the folders of all packages of the workspace that solfer belongs to; without ROS that is solfer alone."""
    own = shipped_folder()
    alone = {} if own is None else {OWN_PACKAGE: os.fspath(own)}
    try:
        import rospkg
    except ModuleNotFoundError:
        return alone
    for path in rospkg.get_ros_paths() or ():
        packages = rospkg.RosPack(ros_paths=[path])
        names = packages.list()
        if OWN_PACKAGE in names:
            return {each: packages.get_path(each) for each in names}
    return alone

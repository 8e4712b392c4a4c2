"""Robots of collections: of Python packages, and of MuJoCo's menagerie."""

import importlib
import importlib.util
import os
import pkgutil
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from solfer.errors import MissingDependency, ModelError, UnknownName
from solfer.installation import pip_install

EXAMPLES = "example-robot-data"
PYBULLET = "pybullet_data"
DESCRIPTIONS_PACKAGE = "robot_descriptions"
MENAGERIE = "menagerie"
COLLECTIONS = (EXAMPLES, PYBULLET, DESCRIPTIONS_PACKAGE, MENAGERIE)

SUFFIXES = (".xml", ".mjcf", ".urdf")
"""Ends of files that are named in place of a collection."""


def find_robot(source: str) -> Path:
    """Find the URDF or the MJCF of a robot.

    Args:
        source: A file, or `COLLECTION:NAME`. The name is that of the file without its end, with its folders where
            several have one name; of the menagerie also that of its folder; of robot_descriptions that of the module.

    Raises:
        UnknownName: There is no such collection, or it has no such robot.
        MissingDependency: The collection is not there.
        ModelError: The name stands for several files, or robot_descriptions cannot get the robot.
    """
    collection, colon, name = source.partition(":")
    if not colon and source.lower().endswith(SUFFIXES):
        return Path(source)
    if collection not in COLLECTIONS:
        raise UnknownName("collection of robots", collection, COLLECTIONS, where=f"--from {source}")
    if collection == DESCRIPTIONS_PACKAGE:
        return _described(name, source)
    folder = _menagerie() if collection == MENAGERIE else folder_of(collection)
    paths = _described_by_mjcf(folder) if collection == MENAGERIE else sorted(folder.rglob("*.urdf"))
    files = {path.relative_to(folder).with_suffix("").as_posix(): path for path in paths}
    if name in files:
        return files[name]
    found = [key for key in files if key.endswith(f"/{name}")] or [key for key in files if key.startswith(f"{name}/")]
    if not found:
        names = {part for key in files for part in (key, *key.split("/"))}
        raise UnknownName("robot", name, sorted(names), where=f"--from {source}")
    # folders are called by the maker and the robot: unitree_go2/go2
    found = [key for key in found if name.endswith(key.rpartition("/")[2])] or found
    if len(found) > 1:
        raise ModelError(
            f"{len(found)} robots are called '{name}'", where=f"--from {source}", expected=", ".join(found)
        )
    return files[found[0]]


def _menagerie() -> Path:
    """Return the folder of MuJoCo's menagerie: here, or in the cache of robot_descriptions."""
    cache = os.environ.get("ROBOT_DESCRIPTIONS_CACHE") or "~/.cache/robot_descriptions"
    folders = [Path(place).expanduser() / "mujoco_menagerie" for place in (".", cache)]
    for folder in folders:
        if folder.is_dir():
            return folder
    raise MissingDependency(
        "MuJoCo's menagerie is not there",
        expected=f"a clone of github.com/google-deepmind/mujoco_menagerie as {' or '.join(map(str, folders))}",
    )


def _described_by_mjcf(folder: Path) -> list[Path]:
    """List the files with robots; a scene includes one of them, beside its floor."""
    return [path for path in sorted(folder.glob("*/*.xml")) if not path.stem.startswith("scene")]


def folder_of(collection: str) -> Path:
    """Return the folder with the robots of example-robot-data or of pybullet_data.

    Raises:
        MissingDependency: The collection is not installed.
    """
    try:
        if collection == EXAMPLES:
            return Path(str(distribution(EXAMPLES).locate_file("cmeel.prefix/share/example-robot-data/robots")))
        spec = importlib.util.find_spec(PYBULLET)
        if spec is not None and spec.origin is not None:
            return Path(spec.origin).parent
    except PackageNotFoundError:
        pass
    raise _missing(collection)


def _described(name: str, source: str) -> Path:
    """Let the package robot_descriptions find a robot: in its cache, else by git."""
    try:
        package = importlib.import_module(DESCRIPTIONS_PACKAGE)
    except ModuleNotFoundError as error:
        raise _missing(DESCRIPTIONS_PACKAGE) from error
    names = [each.name for each in pkgutil.iter_modules(package.__path__) if each.name.endswith("_description")]
    if name not in names:
        raise UnknownName("robot", name, names, where=f"--from {source}")
    try:
        module = importlib.import_module(f"{DESCRIPTIONS_PACKAGE}.{name}")
    except Exception as error:  # whatever git and the network raise
        reason = str(error).strip().splitlines()
        raise ModelError(
            f"robot_descriptions cannot get the robot: {reason[-1] if reason else type(error).__name__}",
            where=f"--from {source}",
            expected="the robot in its cache (~/.cache/robot_descriptions), or a network",
        ) from error
    return Path(module.URDF_PATH if hasattr(module, "URDF_PATH") else module.MJCF_PATH)


def _missing(collection: str) -> MissingDependency:
    return MissingDependency(f"{collection} is not installed", expected=pip_install(collection))

"""What pyproject.toml says that `pip install` needs: what the code imports, in the versions that `./run` installs."""

import ast
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # pytest brings it along

REPOSITORY = Path(__file__).resolve().parents[2]
SOURCES = REPOSITORY / "src"
ROS = {
    SOURCES / "solfer/middleware/ros",
    SOURCES / "solfer/middleware/ros2",
    SOURCES / "solfer_tools/ros_view",
    SOURCES / "solfer/ros_statistics.py",
}
PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
NAMES = {
    "distributed": "dask",
    "foxglove": "foxglove-sdk",
    "pinocchio": "pin",
    "mujoco": "mujoco-core",
    "pybullet_data": "pybullet",
    "pydantic_core": "pydantic",
    "PIL": "Pillow",
    "yaml": "PyYAML",
}
"""Modules whose distribution has another name, or that one brings along."""
IF_THERE = frozenset({"rospkg"})
"""Belongs to ROS; where it is missing, solfer finds its own files without it."""
INDIRECT = frozenset({"PyOpenGL", "solfer"})
"""By PyOpenGL MuJoCo draws; an extra names another one by solfer."""


def imported(path: Path) -> set[str]:
    """Names of the packages that a file imports anywhere."""
    nodes = list(ast.walk(ast.parse(path.read_text())))
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
    return {name.split(".")[0] for name in names}


@pytest.mark.slow
def test_what_is_imported_is_declared_and_nothing_else():
    files = [path for path in SOURCES.rglob("*.py") if not ROS & {path, *path.parents}]
    others = set().union(*map(imported, files)) - sys.stdlib_module_names - IF_THERE - {"solfer", "solfer_tools"}
    used = (
        *PROJECT["dependencies"],
        *EXTRAS["simulation"],
        *EXTRAS["logs"],
        *EXTRAS["study"],
        *EXTRAS["view"],
        *EXTRAS["policy"],
    )
    declared = {Requirement(text).name for text in used}
    assert {NAMES.get(name, name) for name in others} == declared - INDIRECT


@pytest.mark.parametrize("text", [*PROJECT["dependencies"], *(text for extra in EXTRAS.values() for text in extra)])
def test_the_pinned_versions_are_within_the_declared_ranges(text):
    """PyYAML is not pinned: ROS brings Debian's; solfer is one of the extras."""
    files = [REPOSITORY / f"requirements{each}.txt" for each in ("", "-policy", "-study", "-view")]
    lines = [line for file in files for line in file.read_text().splitlines()]
    pins = [Requirement(line) for line in lines if line and not line.startswith("#")]
    declared = Requirement(text)
    versions = [next(iter(pin.specifier)).version for pin in pins if pin.name == declared.name]
    assert versions or declared.name in {"PyYAML", "solfer"}
    assert all(version in declared.specifier for version in versions), versions

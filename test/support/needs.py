"""What tests need that `pip install` does not bring everywhere: ROS and its workspace, and PyBullet.

Where one of them is missing, `pytest --without ros` (or `--without simulation`) leaves out what needs it: the files
below, tests with the mark `needs`, and those that load a robot of PyBullet. Without the option what is missing fails.
"""

import platform
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

FILES = {
    "ros": (
        "ros",
        "unit/ros",
        "integration/faults",
        "integration/package",
        "integration/paper",
        "integration/realtime",
        "integration/shared_memory",
    ),
    "simulation": ("ros", "integration"),
}
"""Files and folders below `test/` that need it; they are not even imported without."""

HAS_WHEEL = sys.version_info < (3, 12) and platform.machine() == "x86_64"
"""Whether requirements.txt asks for PyBullet here: where it does, a test that misses it fails."""

NO_WHEEL = f"PyBullet has no wheel for Python {platform.python_version()} on {platform.machine()}"

needs_bullet = pytest.mark.skipif(not HAS_WHEEL and find_spec("pybullet") is None, reason=NO_WHEEL)

without: set[str] = set()
"""What this run has to do without."""


def left_out(path: Path) -> bool:
    """Return whether a file or folder below `test/`, relative to it, needs what this run has to do without."""
    return any(path.is_relative_to(entry) for need in without for entry in FILES[need])


def pybullet_robot(file: str) -> Path:
    """Return a URDF that PyBullet brings along; `--without simulation` skips the test that asks, as does its lack."""
    if "simulation" in without:
        pytest.skip("a robot of PyBullet")
    if not HAS_WHEEL:
        pytest.importorskip("pybullet_data", reason=NO_WHEEL)
    import pybullet_data

    return Path(pybullet_data.getDataPath(), file)

"""What tests need that `pip install` does not bring everywhere: ROS and its workspace, and PyBullet.

Where one of them is missing, `pytest --without ros` (or `--without simulation`) leaves out what needs it: the files
below, tests with the mark `needs`, and those that load a robot of PyBullet. Without the option what is missing fails.
"""

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

without: set[str] = set()
"""What this run has to do without."""


def left_out(path: Path) -> bool:
    """Return whether a file or folder below `test/`, relative to it, needs what this run has to do without."""
    return any(path.is_relative_to(entry) for need in without for entry in FILES[need])


def pybullet_robot(file: str) -> Path:
    """Return a URDF that PyBullet brings along; `--without simulation` skips the test that asks."""
    if "simulation" in without:
        pytest.skip("a robot of PyBullet")
    import pybullet_data

    return Path(pybullet_data.getDataPath(), file)

"""Ends a program with one error where Python packages are missing. The programs of `nodes/` import it first."""

import sys
from importlib.util import find_spec

from solfer.errors import MissingDependency

PACKAGES = {
    "mcap": "mcap",
    "msgspec": "msgspec",
    "numba": "numba",
    "numpy": "numpy",
    "pinocchio": "pin",
    "pydantic": "pydantic",
    "scipy": "scipy",
    "yaml": "PyYAML",
    "zstandard": "zstandard",
}
"""Modules without which nothing runs, and their names for pip."""

if missing := [package for module, package in PACKAGES.items() if find_spec(module) is None]:
    error = MissingDependency(
        f"{sys.executable} has no {', '.join(missing)}",
        expected=f"`python3 -m pip install {' '.join(missing)}`, in the versions of requirements.txt, or the "
        "environment that has them first on PATH; see docs/how-to/catkin_workspace.md",
    )
    print(f"error: {error}", file=sys.stderr)
    sys.exit(error.exit_code)

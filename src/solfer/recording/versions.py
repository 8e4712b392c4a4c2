"""Versions of what a recording was made with."""

import platform
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from xml.etree import ElementTree

from solfer.config.yaml.files import located
from solfer.errors import SolferError


def versions() -> dict[str, str]:
    """Return the versions of solfer, Python and its libraries, by name; what is not known is left out."""
    found = {"solfer": _own(), "python": platform.python_version()}
    # libraries whose results are in the numbers, and the packages that install them
    libraries = {"numpy": "numpy", "pinocchio": "pin", "scipy": "scipy", "numba": "numba"}
    libraries |= {"pybullet": "pybullet", "mujoco": "mujoco-core"}
    for name, package in libraries.items():
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(package)
    return {name: version for name, version in found.items() if version}


def _own() -> str:
    """Return solfer's version, of its package.xml or as pip installed it; empty: it is not known."""
    with suppress(SolferError, OSError, ElementTree.ParseError):
        manifest = Path(__file__).resolve().parents[3] / "package.xml"
        if not manifest.is_file():
            manifest = located("package://solfer/package.xml", "")
        return ElementTree.parse(manifest).getroot().findtext("version", "")
    with suppress(metadata.PackageNotFoundError):
        return metadata.version("solfer")
    return ""

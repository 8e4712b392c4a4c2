"""Where the meshes are that a URDF names."""

import math
import re
from pathlib import Path
from urllib.parse import unquote, urlsplit

from solfer.config.yaml.files import is_file, located
from solfer.errors import MissingDependency, ModelError, UnknownName

PACKAGE_SCHEME = "package://"
"""Beginning of what lies in a ROS package."""


def find_mesh(urdf: str | Path, name: str) -> Path | None:
    """Find the file of a mesh; None: it is not there.

    `package://NAME/...` lies in a folder NAME that holds the URDF or stands beside one that does, else in the ROS
    package NAME; a path without a scheme is relative to the URDF.

    Args:
        urdf: The URDF's file, or another name of its text; then only ROS packages and absolute paths lead to a file.
        name: What the URDF names.
    """
    return next((path for path in mesh_candidates(urdf, name) if is_file(path)), None)


def unit_of(path: Path) -> float:
    """Return the length of a mesh's unit [m]: that of COLLADA's `<unit meter>`, which PyBullet alone reads; else 1.

    Raises:
        ModelError: It is no number above 0.
    """
    if path.suffix.lower() != ".dae":
        return 1.0
    head = re.sub(rb"<!--.*?-->", b"", path.read_bytes().partition(b"</asset>")[0], flags=re.DOTALL)
    found = re.search(rb"<unit\b[^>]*?\bmeter\s*=\s*[\"']([^\"']*)[\"']", head)
    if found is None:
        return 1.0
    text = found[1].decode(errors="replace")
    try:
        meter = float(text)
    except ValueError:
        meter = math.nan
    if not 0.0 < meter < math.inf:
        raise ModelError(f'<unit meter="{text}">', where=str(path), expected="a number above 0")
    return meter


def mesh_candidates(urdf: str | Path, name: str) -> list[Path]:
    """List where a mesh may be; see `find_mesh`."""
    file = Path(urdf).absolute()
    if name.startswith("file:"):
        return [Path(unquote(urlsplit(name).path))]
    if not name.startswith(PACKAGE_SCHEME):
        return [file.parent / name]
    path = name.removeprefix(PACKAGE_SCHEME).lstrip("/")
    found = [folder / path for folder in file.parents]
    try:
        return [*found, located(PACKAGE_SCHEME + path, "")]
    except (MissingDependency, UnknownName):
        return found

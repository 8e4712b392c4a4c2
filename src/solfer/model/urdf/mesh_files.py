"""Where the meshes are that a URDF names."""

from pathlib import Path
from urllib.parse import unquote, urlsplit

from solfer.config.yaml.files import is_file, located
from solfer.errors import MissingDependency, UnknownName

PACKAGE_SCHEME = "package://"


def find_mesh(urdf: str | Path, name: str) -> Path | None:
    """Find the file of a mesh; None: it is not there.

    `package://NAME/...` lies in a folder NAME that holds the URDF or stands beside one that does, else in the ROS
    package NAME; a path without a scheme is relative to the URDF.

    Args:
        urdf: The URDF's file, or another name of its text; then only ROS packages and absolute paths lead to a file.
        name: What the URDF names.
    """
    return next((path for path in mesh_candidates(urdf, name) if is_file(path)), None)


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

"""The files of a robot's meshes."""

import logging
import re
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from solfer.errors import SimulationError
from solfer.model.collisions.mesh_triangles import triangles_of
from solfer.model.urdf.mesh_files import PACKAGE_SCHEME, find_mesh, mesh_candidates, unit_of

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""A triangle of a binary STL."""

logger = logging.getLogger(__name__)


class MeshReader(NamedTuple):
    """An engine as far as it reads meshes; all read binary STL.

    Attributes:
        name: Its name.
        kinds: Suffixes of the other files that it reads, each with a pattern that is in all of them.
        converted: Suffixes of those that are written as STL for it.
        draws: Whether it has to read the shapes by which robots are seen.
    """

    name: str
    kinds: tuple[tuple[str, bytes], ...]
    converted: tuple[str, ...] = ()
    draws: bool = True


class Meshes:
    """Finds the meshes that a URDF names, see `find_mesh`, and makes an engine read them.

    Args:
        where: The URDF's file, or another name of its text.
        folder: Folder for meshes in a format that the engine reads.
        reader: The engine.
    """

    def __init__(self, where: str, folder: Path, reader: MeshReader):
        self._urdf = where
        self._folder = folder
        self._reader = reader
        self._absent: list[str] = []

    def resolve(self, shape: Element, where: str) -> bool:
        """Make the path of a shape's mesh absolute.

        Args:
            shape: A `<visual>` or `<collision>`.
            where: Its link, for errors.

        Returns:
            False: the mesh of a `<visual>` is missing or not read, so that it has to be left out; `warn` logs it.

        Raises:
            SimulationError: The mesh of a `<collision>` is missing, or the engine reads nothing of it.
            ModelError: The unit of a mesh is no number.
        """
        for mesh in shape.iter("mesh"):
            name = mesh.get("filename", "")
            path = find_mesh(self._urdf, name)
            readable = None if path is None else self._readable(path)
            if readable is not None:
                mesh.set("filename", str(readable))
            elif shape.tag == "visual":
                self._absent.append(f"{where}: '{name}'")
                return False
            elif path is None:
                raise SimulationError(
                    f"the mesh '{name}' of a collision shape is not there", where=where, expected=self._expected(name)
                )
            else:
                raise SimulationError(
                    f"the mesh '{name}' of a collision shape has nothing that {self._reader.name} reads",
                    where=where,
                    expected="triangles as STL, OBJ or COLLADA",
                )
        return True

    def warn(self) -> None:
        """Log which visual shapes were left out."""
        if self._absent:
            more = f" and {len(self._absent) - 1} more" if len(self._absent) > 1 else ""
            logger.warning("visual shapes without their meshes are left out: %s%s", self._absent[0], more)

    def _readable(self, path: Path) -> Path | None:
        """Return the path of a mesh that the engine reads; None: the engine finds nothing in the file.

        An STL is binary then, with no byte behind its triangles.
        """
        unit_of(path)
        kind = path.suffix.lower()
        content = path.read_bytes()
        if kind != ".stl":
            contained = dict(self._reader.kinds)
            if kind in contained and re.search(contained[kind], content):
                return path
            triangles = triangles_of(path) if kind in self._reader.converted else ()
            return self._written(binary_stl(np.array(triangles))) if len(triangles) else None
        size = 84 + TRIANGLE.itemsize * int.from_bytes(content[80:84], "little")
        if len(content) == size > 84:
            return path
        content = content[:size] if len(content) > size > 84 else _binary(content)
        if not content:
            return None
        return self._written(content)

    def _written(self, content: bytes) -> Path:
        """Write an STL to the folder."""
        written = self._folder / f"{len(list(self._folder.iterdir()))}.stl"
        written.write_bytes(content)
        return written

    def _expected(self, name: str) -> str:
        if not name.startswith(PACKAGE_SCHEME):
            return f"the file '{mesh_candidates(self._urdf, name)[0]}'"
        package = name.removeprefix(PACKAGE_SCHEME).lstrip("/").split("/")[0]
        return f"the URDF inside of a folder '{package}', or a ROS package of that name"


def _binary(text: bytes) -> bytes:
    """Write an STL in text as a binary one; empty if it has no triangles."""
    try:
        vertices = re.findall(rb"(?i)\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", text)
        corners = np.array(vertices).astype("<f4").reshape(-1, 3, 3)
    except ValueError:
        return b""
    return binary_stl(corners) if len(corners) else b""


def binary_stl(corners: np.ndarray) -> bytes:
    """Write triangles, shape (n, 3, 3) [m], as a binary STL without normals, which readers compute."""
    triangles = np.zeros(len(corners), TRIANGLE)
    triangles["corners"] = corners
    return bytes(80) + len(corners).to_bytes(4, "little") + triangles.tobytes()

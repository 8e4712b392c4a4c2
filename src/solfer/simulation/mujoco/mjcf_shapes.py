"""The geoms of an MJCF as shapes of a URDF, and their meshes."""

import re
from collections.abc import Iterator
from types import ModuleType
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation.loading.body_urdf import Transform, text_of
from solfer.simulation.loading.meshes import binary_stl

SHOWN = 3
"""First group of geoms that MuJoCo's own viewer hides."""

BALL = "unit_ball"
"""Mesh of ellipsoids, which URDF lacks: a ball of radius 1, scaled."""


class GeomWriter:
    """Writes geoms as `<collision>`, as `<visual>` if they are shown, or as both.

    Args:
        mujoco: The library.
        model: The compiled model.

    Attributes:
        meshes: Binary STLs by name of file.
    """

    def __init__(self, mujoco: ModuleType, model: Any):
        self._types = mujoco.mjtGeom
        self._model = model
        self._files: dict[int, str] = {}
        self._paired = {*model.pair_geom1.tolist(), *model.pair_geom2.tolist()}
        self.meshes: dict[str, bytes] = {}

    def write(self, link: Element, geom: int) -> bool:
        """Add a geom to its link; return False for one that URDF lacks: a plane, height field or distance field."""
        model = self._model
        place = placement(model.geom_pos[geom], model.geom_quat[geom])
        shapes = list(self._shapes(geom))
        collides = bool(model.geom_contype[geom] or model.geom_conaffinity[geom] or geom in self._paired)
        for offset, kind, size in shapes:
            moved = place @ Transform(translation=np.array((0.0, 0.0, offset)))
            tags = (["collision"] if collides else []) + (
                ["visual"] if not collides or model.geom_group[geom] < SHOWN else []
            )
            for tag in tags:
                element = SubElement(link, tag)
                SubElement(element, "origin", moved.origin())
                SubElement(SubElement(element, "geometry"), kind, size)
                if tag == "visual":
                    colour = text_of(self._colour(geom))
                    SubElement(SubElement(element, "material", name=f"rgba {colour}"), "color", rgba=colour)
        return bool(shapes)

    def _shapes(self, geom: int) -> Iterator[tuple[float, str, dict[str, str]]]:
        """Yield the shapes that make up a geom: heights along its z axis [m], elements of URDF, their attributes."""
        types, size = self._types, self._model.geom_size[geom].tolist()
        kind = int(self._model.geom_type[geom])
        if kind == types.mjGEOM_BOX:
            yield 0.0, "box", {"size": text_of([2.0 * half for half in size])}
        elif kind == types.mjGEOM_SPHERE:
            yield 0.0, "sphere", {"radius": repr(size[0])}
        elif kind in (int(types.mjGEOM_CYLINDER), int(types.mjGEOM_CAPSULE)):
            yield 0.0, "cylinder", {"radius": repr(size[0]), "length": repr(2.0 * size[1])}
            if kind == types.mjGEOM_CAPSULE:  # many readers of URDFs know no capsule
                for end in (-size[1], size[1]):
                    yield end, "sphere", {"radius": repr(size[0])}
        elif kind == types.mjGEOM_ELLIPSOID:
            self.meshes.setdefault(f"{BALL}.stl", binary_stl(_ball()))
            yield 0.0, "mesh", {"filename": f"meshes/{BALL}.stl", "scale": text_of(size)}
        elif kind == types.mjGEOM_MESH:
            yield 0.0, "mesh", {"filename": f"meshes/{self._file(int(self._model.geom_dataid[geom]))}"}

    def _file(self, mesh: int) -> str:
        """Write a mesh once: its vertices are in the frame of the geom, and scaled."""
        if mesh not in self._files:
            model = self._model
            stem = re.sub(r"[^\w.-]", "_", model.mesh(mesh).name, flags=re.ASCII) or "mesh"
            name = f"{stem}.stl" if f"{stem}.stl" not in self.meshes else f"{stem}_{mesh}.stl"
            vertices = model.mesh_vert[model.mesh_vertadr[mesh] :]
            faces = model.mesh_face[model.mesh_faceadr[mesh] :][: model.mesh_facenum[mesh]]
            self.meshes[name] = binary_stl(vertices[faces])
            self._files[mesh] = name
        return self._files[mesh]

    def _colour(self, geom: int) -> np.ndarray:
        own = self._model.geom_rgba[geom]
        material = self._model.geom_matid[geom]
        unset = np.array_equal(own, np.array((0.5, 0.5, 0.5, 1.0), dtype=own.dtype))
        return np.asarray(self._model.mat_rgba[material] if material >= 0 and unset else own)


def placement(position: np.ndarray, quaternion: np.ndarray) -> Transform:
    """Return the place of a frame of MuJoCo, whose quaternion is (w, x, y, z)."""
    return Transform(rotation_from_quaternion(np.roll(quaternion, -1)), np.array(position))


def _ball(rings: int = 8) -> np.ndarray:
    """Compute the triangles of a ball of radius 1, shape (n, 3, 3); quads at its poles are thin triangles."""
    polar, azimuth = np.meshgrid(np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, 2 * rings + 1))
    grid = np.stack((np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)), axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    lower = np.stack((a, b, c), axis=-2)[:, :-1]  # without the flat ones at either pole
    upper = np.stack((a, c, d), axis=-2)[:, 1:]
    return np.concatenate((lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3)))

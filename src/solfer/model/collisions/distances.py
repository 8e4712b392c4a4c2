"""Distances between collision shapes of a robot's links, with their nearest points; by coal, behind Pinocchio."""

from collections.abc import Iterable, Sequence
from itertools import product
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from solfer.errors import ModelError
from solfer.model.documents import parse
from solfer.model.kinematics import Kinematics
from solfer.model.urdf.mesh_files import find_mesh, unit_of

LinkPair = tuple[str, str]
"""Names of two links."""


class LinkDistances:
    """Distances of pairs of links that are near to each other, the nearest first.

    Each pair of collision shapes of two links counts by itself. Spheres around all shapes report which are near at all;
    coal computes the distances of these. Meshes count as their convex hulls.

    Args:
        kinematics: Kinematics of the robot.
        pairs: Pairs of links.
        influence: Distance below which two shapes are near [m].
        most: Largest number of distances; of more, the nearest count.

    Attributes:
        count: Number of distances as of the last `update`.
        distance: Distances, negative where shapes overlap, shape (most,) [m]; the first `count` hold.
        normal: Directions from the first shape to the second, world axes, shape (most, 3).
        points: Nearest points of both, in the world, shape (2, most, 3) [m].
        joints: Joints that carry them, shape (2, most).
        shapes: Number of pairs of shapes.

    Raises:
        ModelError: A mesh is not there, or no two links have a collision shape.
    """

    def __init__(self, kinematics: Kinematics, pairs: Sequence[LinkPair], influence: float, most: int = 32):
        self._kinematics = kinematics
        self._influence = influence
        self._geometry = _geometry(kinematics, {link for pair in pairs for link in pair})
        shapes = _shapes_by_link(kinematics, self._geometry)
        for first, second in pairs:
            for one, other in product(shapes.get(first, ()), shapes.get(second, ())):
                self._geometry.addCollisionPair(pin.CollisionPair(one, other))
        self.shapes = len(self._geometry.collisionPairs)
        if not self.shapes:
            raise ModelError(
                "none of the pairs of links has collision shapes",
                where=kinematics.description.where,
                expected="links with a <collision>",
            )
        self._data = self._geometry.createData()
        self._first = np.array([pair.first for pair in self._geometry.collisionPairs])
        self._second = np.array([pair.second for pair in self._geometry.collisionPairs])
        self._carriers, self._centers, radii = _spheres(self._geometry)
        self._reach = (radii[self._first] + radii[self._second] + influence) ** 2
        most = min(most, self.shapes)
        self.count = 0
        self.distance = np.zeros(most)
        self.normal = np.zeros((most, 3))
        self.points = np.zeros((2, most, 3))
        self.joints = np.zeros((2, most), dtype=np.int64)

    def update(self) -> None:
        """Compute the distances at the last update of the kinematics."""
        model, data = self._kinematics.pinocchio
        near = self._near()
        if len(near):
            pin.updateGeometryPlacements(model, data, self._geometry, self._data)
        found = []
        for index in near.tolist():
            result = pin.computeDistance(self._geometry, self._data, index)
            if result.min_distance < self._influence:
                found.append((result.min_distance, index))
        found.sort()
        self.count = min(len(found), len(self.distance))
        for row, (distance, index) in enumerate(found[: self.count]):
            result = self._data.distanceResults[index]
            self.distance[row], self.normal[row] = distance, result.normal
            self.points[0, row], self.points[1, row] = result.getNearestPoint1(), result.getNearestPoint2()
            self.joints[:, row] = self._carriers[self._first[index]], self._carriers[self._second[index]]

    def _near(self) -> np.ndarray:
        """Return the numbers of pairs whose spheres are near to each other."""
        placements = self._kinematics.tree.placements[self._carriers]
        centers = placements[:, 9:].copy()
        for axis in range(3):
            centers += placements[:, 3 * axis : 3 * axis + 3] * self._centers[:, axis, np.newaxis]
        apart = centers[self._first] - centers[self._second]
        return np.flatnonzero(np.einsum("ij,ij->i", apart, apart) < self._reach)


def pairs_that_may_touch(
    kinematics: Kinematics, left_out: Iterable[frozenset[str]], distance: float, position: np.ndarray
) -> list[LinkPair]:
    """List the pairs of links with collision shapes that may touch each other.

    Left out are those on one joint or on neighbouring ones, and those that are too near at a posture, since such
    shapes are drawn larger than the links.

    Args:
        kinematics: Kinematics of the robot; at its last update afterwards.
        left_out: Pairs that never touch, as the SRDF lists them.
        distance: Distance below which two links are too near [m].
        position: The posture, shape (n,) [rad, m].
    """
    links = [name for name, link in kinematics.description.links.items() if link.collisions]
    known = set(left_out)
    pairs = [
        (first, second)
        for index, first in enumerate(links)
        for second in links[index + 1 :]
        if frozenset((first, second)) not in known and not are_neighbours(kinematics, first, second)
    ]
    if not pairs:
        return []
    kinematics.update(position)
    near = {frozenset(pair) for pair in _nearer(kinematics, pairs, distance)}
    return [pair for pair in pairs if frozenset(pair) not in near]


def are_neighbours(kinematics: Kinematics, first: str, second: str) -> bool:
    """Return whether at most one moving joint is between two links."""
    one = kinematics.attachment(first).joint
    other = kinematics.attachment(second).joint
    parents = kinematics.tree.parents
    return one == other or parents[one] == other or parents[other] == one


def _nearer(kinematics: Kinematics, pairs: list[LinkPair], distance: float) -> set[LinkPair]:
    """Find the pairs of links that are nearer than a distance."""
    model, data = kinematics.pinocchio
    geometry = _geometry(kinematics, {link for pair in pairs for link in pair})
    shapes = _shapes_by_link(kinematics, geometry)
    owners = []
    for first, second in pairs:
        for one, other in product(shapes.get(first, ()), shapes.get(second, ())):
            geometry.addCollisionPair(pin.CollisionPair(one, other))
            owners.append((first, second))
    placed = geometry.createData()
    pin.updateGeometryPlacements(model, data, geometry, placed)
    pin.computeDistances(geometry, placed)
    results = zip(owners, placed.distanceResults, strict=True)
    return {pair for pair, result in results if result.min_distance < distance}


def _geometry(kinematics: Kinematics, links: set[str]) -> pin.GeometryModel:
    """Build the collision shapes of some links."""
    description = kinematics.description
    robot = parse(description.text)
    for link in robot.findall("link"):
        for shape in link.findall("visual") + ([] if link.get("name") in links else link.findall("collision")):
            link.remove(shape)
    for mesh in robot.iter("mesh"):  # Pinocchio reads no units
        path = find_mesh(description.where, mesh.get("filename", ""))
        if path is not None:
            scale = np.array(mesh.get("scale", "1 1 1").split(), dtype=float) * unit_of(path)
            mesh.set("scale", " ".join(map(repr, scale.tolist())))
    folders = [str(folder) for folder in Path(description.where).absolute().parents]
    try:
        geometry = pin.buildGeomFromUrdfString(
            kinematics.pinocchio[0],
            ElementTree.tostring(robot, "unicode"),
            pin.GeometryType.COLLISION,
            package_dirs=folders,
        )
        for shape in geometry.geometryObjects:
            if isinstance(shape.geometry, pin.hppfcl.BVHModelBase):
                shape.geometry.buildConvexHull(False, "Qt")
                shape.geometry = shape.geometry.convex
            shape.geometry.computeLocalAABB()
    except (ValueError, RuntimeError) as error:
        raise ModelError(
            f"Pinocchio cannot read the collision shapes: {error}",
            where=description.where,
            expected="meshes that are there, and have a volume",
        ) from error
    return geometry


def _shapes_by_link(kinematics: Kinematics, geometry: pin.GeometryModel) -> dict[str, list[int]]:
    shapes: dict[str, list[int]] = {}
    frames = kinematics.pinocchio[0].frames
    for index, shape in enumerate(geometry.geometryObjects):
        shapes.setdefault(frames[shape.parentFrame].name, []).append(index)
    return shapes


def _spheres(geometry: pin.GeometryModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return joint, centre in its frame and radius of a sphere around each shape."""
    shapes = list(geometry.geometryObjects)
    centers = [shape.placement.act(np.array(shape.geometry.aabb_center)) for shape in shapes]
    radii = [float(shape.geometry.aabb_radius) for shape in shapes]
    return np.array([shape.parentJoint for shape in shapes]), np.array(centers), np.array(radii)

"""How a robot that would fall over upright is tilted until it rests on what touches the ground."""

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from solfer.numerics.rotations import quaternion_from_rotation, rotation_from_quaternion
from solfer.simulation.robot_body.body import SEARCH_DISTANCES, Body

TOUCH_HEIGHT = 1e-4
"""Height up to which a point counts as touching the ground [m]."""


def rests(body: Body, ground: int, normal: np.ndarray) -> bool:
    """Return whether a robot, put down as it is, surely rests on a plane: its centre of mass is above lowest points.

    That it is not so means nothing for soles: of a flat one an engine may name one of the lowest points.

    Args:
        body: The robot.
        ground: The plane.
        normal: Its normal, shape (3,).
    """
    return _carried(_lowest(body, ground, normal), body.center_of_mass())


def resting_orientation(
    body: Body, joints: Sequence[float] | np.ndarray, upright: np.ndarray, ground: int
) -> np.ndarray | None:
    """Find out how a robot has to be tilted to rest on a plane like a rigid body.

    A rigid body rests on a face of its convex hull that is below its centre of mass. The hull's vertices are collected
    by tilting the robot, which stays tilted afterwards.

    Args:
        body: The robot.
        joints: Its posture [rad, m].
        upright: Orientation in which it stands upright on the plane, (x, y, z, w), shape (4,).
        ground: The plane.

    Returns:
        The orientation next to upright in which it rests; None: it rests upright, but for a tilt of 0.3
        degrees from which it comes to rest by itself, or nowhere within 10 degrees.
    """
    start = rotation_from_quaternion(upright)
    tilt_of_corners = 2e-4  # [rad], at which the corners of a flat sole are its lowest points
    soles = _vertices(body, joints, start, ground=ground, tilts=_tilts(start, (tilt_of_corners,)))
    body.place(joints)
    center = body.center_of_mass()
    normal = start[:, 2]
    heights = soles @ start.T @ normal
    if _carried(soles[heights < heights.min() + TOUCH_HEIGHT] @ start.T, start @ center):
        return None
    nearest = math.radians(10.0)  # more does not count as put down upright
    steps = np.linspace(0.0, nearest, 11)
    found = None
    for corners, outward in _faces(_vertices(body, joints, start, ground=ground, tilts=_tilts(start, steps)), center):
        tilt = _rotation_vector(start @ outward, -normal)
        rotation = _rotation(tilt) @ start
        if np.linalg.norm(tilt) < nearest and _below(center, corners, -rotation[2]):
            nearest = float(np.linalg.norm(tilt))
            found = quaternion_from_rotation(rotation)
    return found if nearest > math.radians(0.3) else None


def _lowest(body: Body, ground: int, normal: np.ndarray) -> np.ndarray:
    """Find the lowest points of the robot above a plane with this normal, shape (n, 3) [m]."""
    points = body.near(ground, SEARCH_DISTANCES[-1])
    heights = points @ normal
    return points[heights < heights.min() + TOUCH_HEIGHT]


def _carried(points: np.ndarray, center: np.ndarray) -> bool:
    """Return whether `center` is above the inside of the convex hull of points, shape (n, 3)."""
    away = (points - center)[:, :2]
    angles = np.sort(np.arctan2(away[:, 1], away[:, 0]))
    gaps = np.diff(angles, append=angles[:1] + 2.0 * math.pi)
    return bool(gaps.max() < math.pi)


def _vertices(
    body: Body, joints: Sequence[float] | np.ndarray, start: np.ndarray, ground: int, tilts: Iterable[np.ndarray]
) -> np.ndarray:
    """Collect the lowest points of the tilted robot, in axes of its base link, shape (n, 3) [m]."""
    normal = start[:, 2]
    found = []
    for tilt in tilts:
        rotation = _rotation(tilt) @ start
        body.place(joints, normal, quaternion_from_rotation(rotation))
        found.append((_lowest(body, ground, normal) - normal) @ rotation)
    return np.concatenate(found)


def _tilts(start: np.ndarray, angles: Iterable[float]) -> Iterator[np.ndarray]:
    """Iterate over rotation vectors of these lengths in all directions of the plane, shape (3,) [rad]."""
    count = 16  # directions
    for angle in angles:
        for direction in np.arange(count) * (2.0 * math.pi / count):
            yield angle * (math.cos(direction) * start[:, 0] + math.sin(direction) * start[:, 1])


def _faces(points: np.ndarray, center: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Iterate over triangles of the convex hull of points and a centre above them, and their outward normals."""
    from scipy.spatial import ConvexHull, QhullError  # heavy, and needed by robots that would fall over

    try:
        hull = ConvexHull(np.concatenate((points, [center])))
    except QhullError:  # all of them are in a plane
        return
    for corners, plane in zip(hull.simplices, hull.equations, strict=True):
        if len(points) not in corners:
            yield points[corners], plane[:3]


def _rotation(vector: np.ndarray) -> np.ndarray:
    """Compute the rotation of a rotation vector that is shorter than pi, shape (3, 3)."""
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle else vector
    return rotation_from_quaternion((*(math.sin(angle / 2.0) * axis), math.cos(angle / 2.0)))


def _rotation_vector(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Compute the shortest rotation vector from one unit vector to another, shape (3,) [rad]."""
    axis = np.cross(start, end)
    length = float(np.linalg.norm(axis))
    return axis * (math.atan2(length, float(start @ end)) / length if length else 1.0)


def _below(center: np.ndarray, corners: np.ndarray, down: np.ndarray) -> bool:
    """Return whether the ray from `center` along `down` meets a triangle."""
    edges = np.column_stack((corners[1] - corners[0], corners[2] - corners[0], -down))
    if abs(np.linalg.det(edges)) < 1e-15:
        return False
    first, second, shift = np.linalg.solve(edges, center - corners[0])
    return bool(first >= 0.0 and second >= 0.0 and first + second <= 1.0 and shift > 0.0)

"""The support polygon: how far the balance is from its edges, and the wheels from their hips."""

import math
from collections.abc import Iterable, Sequence

import numpy as np


class FootprintGeometry:
    """Margins of a point in the polygon of the vertices, and distances of wheels from hips, with their gradients.

    The margin of the edge from the vertex p clockwise to the vertex q, with d = p - q and e = p - b for the point b, is
    m = (d_y e_x - d_x e_y) / |d|: positive inside.

    Args:
        count: Number of wheels.

    Attributes:
        edges: The edge that begins at each vertex: its two vertices.
        margins: Margins of the edges, shape (count,) [m].
        of_start, of_end: Gradients of the margins by the two vertices of the edge, shape (count, 2).
        of_point: Gradients by the point, shape (count, 2).
        legs: Hips minus the centres of their wheels, shape (count, 3) [m].
        distances: Their lengths, shape (count,) [m].
    """

    def __init__(self, count: int):
        self.edges = [(index, (index + 1) % count) for index in range(count)]
        self.margins, self.distances = np.zeros((2, count))
        self.of_start, self.of_end, self.of_point = np.zeros((3, count, 2))
        self.legs = np.zeros((count, 3))

    def start(self, vertices: np.ndarray) -> None:
        """Find the edges of vertices, shape (count, 3) [m]: clockwise around their mean, as seen from above."""
        mean = vertices[:, :2].mean(axis=0)
        order = np.argsort(-np.arctan2(*(vertices[:, :2] - mean).T[::-1])).tolist()
        after = dict(zip(order, order[1:] + order[:1], strict=True))
        self.edges = [(index, after[index]) for index in range(len(order))]

    def update(self, vertices: Sequence[Sequence[float]], point: Sequence[float]) -> None:
        """Compute the margins of a point, of which x and y count; all in one frame whose z is up [m]."""
        bx = point[0]
        by = point[1]
        for index, (first, second) in enumerate(self.edges):
            px = vertices[first][0]
            py = vertices[first][1]
            qx = vertices[second][0]
            qy = vertices[second][1]
            dx = px - qx
            dy = py - qy
            ex = px - bx
            ey = py - by
            fx = qx - bx
            fy = qy - by
            length = max(math.hypot(dx, dy), 1e-9)
            margin = (dy * ex - dx * ey) / length
            along_x = dx * margin / length**2
            along_y = dy * margin / length**2
            self.margins[index] = margin
            self.of_start[index] = -along_x - fy / length, -along_y + fx / length
            self.of_end[index] = along_x + ey / length, along_y - ex / length
            self.of_point[index] = -dy / length, dx / length

    def measure_legs(self, legs: Iterable[tuple[float, float, float]]) -> None:
        """Take over hips minus the centres of their wheels, in the frame of the vertices [m]."""
        for index, (x, y, z) in enumerate(legs):
            self.legs[index] = x, y, z
            self.distances[index] = math.sqrt(x * x + y * y + z * z)

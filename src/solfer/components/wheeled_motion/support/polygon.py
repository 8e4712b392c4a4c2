"""The support polygon, and how far the centre of mass is inside of it."""

from collections.abc import Sequence

import numpy as np

from solfer.components.wheeled_motion.support.kernel import EDGE_SIZE, INSIDE, NORMAL_X, NORMAL_Y, find_edges
from solfer.numerics.pointers import address
from solfer.points import CenterOfMass, SupportVertex


class SupportPolygon:
    """The polygon of the vertices on the ground, and the centre of mass in it.

    Args:
        vertices: The vertices, which are up to date; their arrays stay where they are.
        center: The centre of mass, as they.
        required_margin: Margin that motions leave [m].

    Attributes:
        required_margin: As above.
        points: Addresses of the values and Jacobians of the vertices, then of the centre of mass, shape (m + 1, 2).
        order: Working space, shape (m,).
        edges: Edges in the columns of `solfer.components.wheeled_motion.support.kernel`, shape (m, EDGE_SIZE).
    """

    def __init__(self, vertices: Sequence[SupportVertex], center: CenterOfMass, required_margin: float):
        self._points = (*vertices, center)
        count = len(vertices)
        self.required_margin = required_margin
        self.points = np.array([(address(point.value), address(point.jacobian)) for point in self._points])
        self.order = np.zeros(count, dtype=np.int64)
        self.edges = np.zeros((count, EDGE_SIZE))

    def towards(self, lifted: Sequence[int], margin: float) -> tuple[float, float]:
        """Return the shortest shift of the centre of mass to where the others carry it with a margin [m], world x, y.

        Args:
            lifted: Indices of wheels that are not to carry it.
            margin: The margin [m].
        """
        flags = np.zeros(len(self.edges), dtype=bool)
        flags[list(lifted)] = True
        edges = self.edges[: find_edges(self.points, flags, self.order, self.edges)]
        normals = edges[:, [NORMAL_X, NORMAL_Y]]
        shift = np.zeros(2)
        for _ in range(32):  # projections on half-planes, one after the other, meet in their common part
            lacks = margin - (edges[:, INSIDE] + normals @ shift)
            shortest = int(lacks.argmax())
            if lacks[shortest] < 1e-4:  # [m]
                break
            shift += lacks[shortest] * normals[shortest]
        return float(shift[0]), float(shift[1])

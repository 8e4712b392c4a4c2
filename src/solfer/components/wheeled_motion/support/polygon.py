"""The support polygon, and how far the centre of mass is inside of it."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.points import CenterOfMass, Handler, SupportVertex
from solfer.tasks.task import updated_in_order

HORIZON = 0.25
"""Time in which a motion may use up what is left of the margin [s]."""

Edge = tuple[int, int]


class SupportPolygon:
    """The polygon of the vertices on the ground, and the centre of mass in it.

    Args:
        vertices: The vertices, which are up to date.
        center: The centre of mass.
        is_current: Whether the centre of mass is up to date, too; else it is computed here.
        least: Margin that motions leave [m].

    Attributes:
        margin: Distance of the centre of mass from the nearest edge [m], as of the last `update`; negative: outside.
        is_held: Whether the last motion was shortened.
    """

    def __init__(self, vertices: Sequence[SupportVertex], center: CenterOfMass, is_current: bool, least: float):
        self._vertices, self._center, self._least = tuple(vertices), center, least
        self._handler = None if is_current else Handler(updated_in_order(center))
        self._edges: list[tuple[Edge, float, float, float]] = []
        self.margin, self.is_held = math.inf, False

    def update(self, lifted: np.ndarray) -> None:
        """Compute the margin with some wheels lifted, shape (m,)."""
        if self._handler is not None:
            self._handler.update()
        self._edges = self._find_edges([index for index, off in enumerate(lifted.tolist()) if not off])
        self.margin = min(margin for _, margin, _, _ in self._edges)

    def towards(self, lifted: Sequence[int], least: float) -> tuple[float, float]:
        """Return the shortest way of the centre of mass to where the others carry it with a margin [m], world x, y.

        Args:
            lifted: Indices of wheels that are not to carry it.
            least: The margin [m].
        """
        if self._handler is not None:
            self._handler.update()
        edges = self._find_edges([index for index in range(len(self._vertices)) if index not in lifted])
        x = y = 0.0
        for _ in range(32):  # projections on half-planes, in turn, meet in their common part
            short, (nx, ny) = 0.0, (0.0, 0.0)
            for _, margin, ex, ey in edges:
                lack = least - (margin + ex * x + ey * y)
                if lack > short:
                    short, nx, ny = lack, ex, ey
            if short < 1e-4:
                break
            x, y = x + short * nx, y + short * ny
        return x, y

    def share(self, velocity: np.ndarray) -> float:
        """Return the share of joint velocities, shape (n,), with which the margin does not fall below what is left."""
        share, self.is_held = 1.0, False
        for (a, b), margin, nx, ny in self._edges:
            left = margin - self._least
            if left > 0.1:  # no motion is faster than that
                continue
            rate = self._rate(a, b, nx, ny, velocity)
            if left + HORIZON * share * rate < 0.0:
                share, self.is_held = max(0.0, -left / (HORIZON * rate)) if rate < 0.0 else 1.0, True
        return share

    def _rate(self, a: int, b: int, nx: float, ny: float, velocity: np.ndarray) -> float:
        """Return how fast the centre of mass moves away from an edge [m/s]."""
        first, second, center = self._vertices[a], self._vertices[b], self._center
        (ax, ay), (bx, by) = first.value[:2].tolist(), second.value[:2].tolist()
        cx, cy = center.value[:2].tolist()
        way = (cx - ax) * (bx - ax) + (cy - ay) * (by - ay)
        part = way / max((bx - ax) ** 2 + (by - ay) ** 2, 1e-12)
        vx, vy = np.dot(center.jacobian[:2], velocity).tolist()
        ux, uy = np.dot(first.jacobian[:2], velocity).tolist()
        wx, wy = np.dot(second.jacobian[:2], velocity).tolist()
        vx -= ux + part * (wx - ux)
        vy -= uy + part * (wy - uy)
        return nx * vx + ny * vy

    def _find_edges(self, carrying: list[int]) -> list[tuple[Edge, float, float, float]]:
        """Return edges with the centre's distance from each, and the normal to the inside."""
        places = {index: self._vertices[index].value[:2].tolist() for index in carrying}
        x, y = (sum(place[axis] for place in places.values()) / len(places) for axis in (0, 1))
        order = sorted(carrying, key=lambda index: math.atan2(places[index][1] - y, places[index][0] - x))
        cx, cy = self._center.value[:2].tolist()
        edges = []
        for a, b in zip(order, [*order[1:], order[0]], strict=True):
            (ax, ay), (bx, by) = places[a], places[b]
            length = max(math.hypot(bx - ax, by - ay), 1e-9)
            nx, ny = (ay - by) / length, (bx - ax) / length
            edges.append(((a, b), nx * (cx - ax) + ny * (cy - ay), nx, ny))
        return edges

"""The support polygon, seen from above."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull, QhullError


def hull(points: np.ndarray) -> list[int]:
    """Find the corners of the convex hull of points, seen from above, against the clock.

    Args:
        points: Shape (k, 3) [m].

    Returns:
        Indices of the corners; fewer than three: the points lie on a line.
    """
    try:
        corners: list[int] = ConvexHull(points[:, :2]).vertices.tolist()
    except (QhullError, ValueError):  # fewer than three, or all on a line
        return []
    return corners


def shrunk(corners: np.ndarray, margins: Sequence[float]) -> np.ndarray:
    """Cut off what is nearer to the edges of a convex polygon than its margins.

    Args:
        corners: Against the clock, shape (k, 3) [m].
        margins: Margin of the edge from each corner to the next [m].

    Returns:
        The corners of what is left, shape (l, 3) [m]; empty: nothing is.
    """
    left = corners
    for start, end, margin in zip(corners, np.roll(corners, -1, axis=0), margins, strict=True):
        dx, dy = end[:2] - start[:2]
        inward = np.array((-dy, dx)) / np.hypot(dx, dy)
        left = _cut(left, (left[:, :2] - start[:2]) @ inward - margin)
    return left


def _cut(corners: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Keep the part of a polygon whose distances `inside` a line, of the corners, are not negative."""
    kept = []
    for index, distance in enumerate(inside):
        before = inside[index - 1]
        if (distance >= 0.0) != (before >= 0.0):
            ratio = before / (before - distance)
            kept.append(corners[index - 1] + ratio * (corners[index] - corners[index - 1]))
        if distance >= 0.0:
            kept.append(corners[index])
    return np.array(kept).reshape(-1, 3)

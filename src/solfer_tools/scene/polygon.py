"""The support polygon, seen from above."""

from collections.abc import Sequence

import numpy as np


def hull(points: np.ndarray) -> list[int]:
    """Find the corners of the convex hull of points, seen from above, against the clock.

    Args:
        points: Shape (k, 3) [m].

    Returns:
        Indices of the corners; fewer than three: the points lie on a line.
    """
    order = sorted(range(len(points)), key=lambda index: (points[index, 0], points[index, 1]))
    half: list[int] = []
    for side in (order, order[::-1]):
        start = len(half)
        for index in side:
            while len(half) - start >= 2 and _cross(points, half[-2], half[-1], third=index) <= 0.0:
                half.pop()
            half.append(index)
        del half[-1:]
    return half


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


def _cross(points: np.ndarray, first: int, second: int, third: int) -> float:
    (ax, ay), (bx, by), (cx, cy) = points[[first, second, third], :2].tolist()
    cross: float = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return cross


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

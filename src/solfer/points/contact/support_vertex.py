"""Vertices of the support polygon: lowest points of wheels in the form of a torus."""

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import PointError
from solfer.model.view import RobotView
from solfer.points.compiled.registry import Kernel
from solfer.points.compiled.wheels import vertex
from solfer.points.offset import direction, finite
from solfer.points.rigid import LinkPoint
from solfer.points.space import vector

__all__ = ["SupportVertex"]

UP = (0.0, 0.0, 1.0)
"""Default of axes and normals."""


class SupportVertex(LinkPoint):
    """Vertex of the support polygon below a wheel in the form of a torus, in the world [m].

    With the wheel's centre c, its axis a, the ground's normal n and the radii R of the ring and r of the tube:
    p = c - R (n - a (a.n)) / |n - a (a.n)| - r n. The Jacobian maps to the velocity of this geometric point, not to
    that of the wheel's material, which is a `RollingContact`. The vertex of a wheel that lies flat is below its centre.

    Args:
        link: Name of the wheel's link.
        robot: The Robot.
        ring: Radius of the circle that the tube's centre runs along [m].
        tube: Radius of the tube [m].
        axis: Axis of the wheel in the frame of the link, any length, shape (3,).
        center: Centre of the wheel in the frame of the link, shape (3,) [m].
        normal: Normal of the ground in the world, any length, shape (3,).

    Attributes:
        link: Name of the wheel's link.

    Raises:
        UnknownName: The robot has no such link.
        SizeMismatch, NotFinite: A vector is not three finite numbers, or is zero where a direction is needed.
        PointError: A radius is negative.
    """

    kernels: ClassVar[tuple[Kernel, ...]] = (vertex,)

    def __init__(
        self,
        link: str,
        robot: RobotView,
        ring: float,
        tube: float,
        axis: ArrayLike = UP,
        *,
        center: ArrayLike = (0.0, 0.0, 0.0),
        normal: ArrayLike = UP,
    ):
        super().__init__(vector(3), link, robot, count=11)
        # centre and axis in the frame of the joint, normal, radii
        rotation = self._attachment.rotation
        center = finite(center, 3, f"centre of wheel '{link}'")
        self._numbers[:3] = rotation @ center + self._attachment.translation
        self._numbers[3:6] = rotation @ direction(axis, f"axis of wheel '{link}'")
        self.set_normal(normal)
        if not (0.0 <= ring < np.inf and 0.0 <= tube < np.inf):
            raise PointError(
                f"wheel '{link}' has the radii {ring:g} and {tube:g}", expected="radii that are not negative"
            )
        self._numbers[9:] = ring, tube

    @property
    def normal(self) -> np.ndarray:
        """Unit normal of the ground in the world, shape (3,); live. What is written has to be of length one."""
        return self._numbers[6:9]

    def set_normal(self, normal: ArrayLike) -> None:
        """Set the normal of the ground in the world, any length, shape (3,).

        Raises:
            SizeMismatch, NotFinite: It is not a direction.
        """
        self._numbers[6:9] = direction(normal, f"normal below wheel '{self.link}'")

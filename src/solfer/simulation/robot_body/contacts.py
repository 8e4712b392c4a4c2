"""The links of a robot that touch the world, and the forces on them."""

from typing import NamedTuple

import numpy as np

from solfer.simulation.robot_body.body import Body
from solfer.simulation.world.engine import Engine

Vector = tuple[float, float, float]


class ContactPoint(NamedTuple):
    """Where the world pushes a link.

    Attributes:
        link: The link.
        position: The point on the link in the world [m].
        force: Force on the link, normal and friction together, in world axes [N].
    """

    link: str
    position: Vector
    force: Vector


class ContactDetector:
    """Contacts of a body in the newest step.

    Args:
        engine: The world.
        body: The robot.
    """

    def __init__(self, engine: Engine, body: Body):
        self._engine = engine
        self._body = body

    def points(self) -> list[ContactPoint]:
        """List all points at which the world pushes the robot."""
        found = self._engine.bullet.getContactPoints(self._body.id, physicsClientId=self._engine.client)
        return [ContactPoint(self._body.links[point[3]], point[5], _force(point)) for point in found if point[9] > 0.0]

    def links(self) -> tuple[str, ...]:
        """List the links that are pushed, in PyBullet's order."""
        return tuple(self.forces())

    def forces(self) -> dict[str, np.ndarray]:
        """Sum up the force on each link that is pushed, normal and friction, in world axes, shape (3,) [N]."""
        forces: dict[str, np.ndarray] = {}
        for point in self.points():
            forces[point.link] = forces.get(point.link, 0.0) + np.array(point.force)
        return dict(sorted(forces.items(), key=lambda item: self._body.links.index(item[0])))


def _force(point: tuple) -> Vector:
    """Add PyBullet's normal force along the normal and its friction along two lateral directions."""
    (nx, ny, nz), normal, lateral, (ax, ay, az), other, (bx, by, bz) = point[7], *point[9:14]
    return (
        normal * nx + lateral * ax + other * bx,
        normal * ny + lateral * ay + other * by,
        normal * nz + lateral * az + other * bz,
    )

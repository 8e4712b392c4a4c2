"""The base of a robot in PyBullet: by its centre of mass and in its principal axes there, by its origin outside."""

from collections.abc import Sequence

import numpy as np

from solfer.numerics.rotations import quaternion_product, rotated
from solfer.simulation.bullet.client import BulletClient


class BulletBase:
    """The base link of a body.

    Args:
        client: The world.
        body: Number of the body.
    """

    def __init__(self, client: BulletClient, body: int):
        self._bullet = client.bullet
        self._body = body
        self._to_com = tuple(self._bullet.getDynamicsInfo(body, -1)[3:5])
        # not by PyBullet's own functions of transforms, which compute with single precision
        x, y, z, w = self._to_com[1]
        self._rotation_from_com = -x, -y, -z, w
        self._from_com = rotated([-each for each in self._to_com[0]], self._rotation_from_com)

    def place(self, position: Sequence[float] | np.ndarray, orientation: Sequence[float] | np.ndarray) -> None:
        """Put the link's origin somewhere, at rest."""
        offset, rotation = self._to_com
        com = np.add(position, rotated(offset, orientation)).tolist()
        self._bullet.resetBasePositionAndOrientation(self._body, com, quaternion_product(orientation, rotation))
        self._bullet.resetBaseVelocity(self._body, [0.0] * 3, [0.0] * 3)

    def read(self, motion: np.ndarray) -> None:
        """See `RobotInEngine.read_base`."""
        com, orientation = self._bullet.getBasePositionAndOrientation(self._body)
        (vx, vy, vz), (wx, wy, wz) = self._bullet.getBaseVelocity(self._body)
        x, y, z = rotated(self._from_com, orientation)  # from the centre of mass to the origin
        cx = -x
        cy = -y
        cz = -z
        motion[:] = (
            *quaternion_product(orientation, self._rotation_from_com),
            com[0] + x,
            com[1] + y,
            com[2] + z,
            vx - (wy * cz - wz * cy),
            vy - (wz * cx - wx * cz),
            vz - (wx * cy - wy * cx),
            wx,
            wy,
            wz,
        )

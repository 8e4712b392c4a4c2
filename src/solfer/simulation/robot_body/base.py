"""The base of a robot in a PyBullet world: where its link is, and how it moves."""

from collections.abc import Sequence

import numpy as np

from solfer.numerics.base_chart import BaseChart
from solfer.numerics.rotations import quaternion_product, rotated
from solfer.simulation.world.engine import Engine


class FloatingBase:
    """The base link of a body, which PyBullet has by its centre of mass and in its principal axes.

    Args:
        engine: The world.
        body: Number of the body.
        chart: Chart of the base; None: it does not move.

    Attributes:
        position, orientation: Pose of the link's origin in the world, shape (3,) [m] and (4,), (x, y, z, w).
        linear, angular: Velocity of its origin [m/s] and angular velocity [rad/s] in world axes, shape (3,) each.
        floats: Whether it moves.
    """

    def __init__(self, engine: Engine, body: int, chart: BaseChart | None):
        self._bullet = engine.bullet
        self._client = engine.client
        self._body = body
        self.floats = chart is not None
        motion = np.zeros(13)
        self.orientation, self.position, self.linear, self.angular = np.split(motion, (4, 7, 10))
        self.orientation[3] = 1.0
        if chart is not None:
            # imported here: its compiler takes a while to load
            from solfer.numerics.twist_transport import FROM_POSE, FROM_TWIST, WITH_ORIENTATION, Carried

            at_base = np.concatenate((np.eye(3).ravel(), np.zeros(9)))
            self._in_chart = Carried(chart, motion, at_base)
            self._whole = WITH_ORIENTATION | FROM_POSE | FROM_TWIST
        self._to_com = tuple(self._bullet.getDynamicsInfo(body, -1, self._client)[3:5])
        # not by PyBullet's own functions of transforms, which compute with single precision
        x, y, z, w = self._to_com[1]
        self._turn_from_com = -x, -y, -z, w
        self._from_com = rotated([-each for each in self._to_com[0]], self._turn_from_com)

    def place(self, position: Sequence[float] | np.ndarray, orientation: Sequence[float] | np.ndarray) -> None:
        """Put the link's origin somewhere, at rest; no effect if the base does not move."""
        if not self.floats:
            return
        offset, turn = self._to_com
        com = np.add(position, rotated(offset, orientation)).tolist()
        self._bullet.resetBasePositionAndOrientation(
            self._body, com, quaternion_product(orientation, turn), self._client
        )
        self._bullet.resetBaseVelocity(self._body, [0.0] * 3, [0.0] * 3, self._client)

    def read(self, q: np.ndarray, v: np.ndarray) -> None:
        """Read the base, and write its positions and velocities, the first six; no effect if it does not move."""
        if not self.floats:
            return
        com, orientation = self._bullet.getBasePositionAndOrientation(self._body, self._client)
        (vx, vy, vz), (wx, wy, wz) = self._bullet.getBaseVelocity(self._body, self._client)
        x, y, z = rotated(self._from_com, orientation)  # from the centre of mass to the origin
        cx = -x
        cy = -y
        cz = -z
        self.position[:] = com[0] + x, com[1] + y, com[2] + z
        self.orientation[:] = quaternion_product(orientation, self._turn_from_com)
        self.linear[:] = vx - (wy * cz - wz * cy), vy - (wz * cx - wx * cz), vz - (wx * cy - wy * cx)
        self.angular[:] = wx, wy, wz
        self._in_chart.update(self._whole)
        q[:6], v[:6] = self._in_chart.base, self._in_chart.rates

"""Which links of a robot touch the world, and how hard they are pushed."""

import numpy as np

from solfer.simulation.body import Body
from solfer.simulation.engine import Engine


class Contacts:
    """Contacts of a body in the newest step.

    Args:
        engine: The world.
        body: The robot.
    """

    def __init__(self, engine: Engine, body: Body):
        self._engine, self._body = engine, body

    def links(self) -> tuple[str, ...]:
        """Names of the links that are pushed, in PyBullet's order."""
        return tuple(self.forces())

    def forces(self) -> dict[str, np.ndarray]:
        """Force on each link that is pushed, normal and friction together, in world axes, shape (3,) [N]."""
        forces: dict[str, np.ndarray] = {}
        points = self._engine.bullet.getContactPoints(self._body.id, physicsClientId=self._engine.client)
        for point in points:
            force = (point[9] * np.array(point[7]) + point[10] * np.array(point[11]) + point[12] * np.array(point[13]))
            if point[9] > 0.0:
                link = self._body.links[point[3]]
                forces[link] = forces.get(link, 0.0) + force
        return dict(sorted(forces.items(), key=lambda item: self._body.links.index(item[0])))

"""The links of a robot that touch the world, and the forces on them."""

import numpy as np

from solfer.simulation.physics import ContactPoint
from solfer.simulation.robot_body.body import Body


class ContactDetector:
    """Contacts of a body in the newest step.

    Args:
        body: The robot.
    """

    def __init__(self, body: Body):
        self._body = body

    def points(self) -> list[ContactPoint]:
        """List all points at which the world pushes the robot."""
        return self._body.robot.contacts()

    def links(self) -> tuple[str, ...]:
        """List the links that are pushed, in the engine's order."""
        return tuple(self.forces())

    def forces(self) -> dict[str, np.ndarray]:
        """Sum up the force on each link that is pushed, normal and friction, in world axes, shape (3,) [N]."""
        forces: dict[str, np.ndarray] = {}
        for point in self.points():
            forces[point.link] = forces.get(point.link, 0.0) + np.array(point.force)
        return dict(sorted(forces.items(), key=lambda item: self._body.links.index(item[0])))

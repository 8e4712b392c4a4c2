"""Where the balance of a robot is in its support polygon, and how far wheels are from their hips."""

import numpy as np

from solfer.components.support_shaping.polygon import FootprintGeometry
from solfer.components.support_shaping.tags import SupportShapingTags
from solfer.components.wheeled_motion.wheels import DrivenWheels
from solfer.errors import ComponentError, UnknownName
from solfer.numerics.planar_move import seen_from
from solfer.robot import Robot


class BalanceMeasure:
    """Measures polygon and legs, seen from the heading of the base at its place.

    The balance is the centre of pressure of the contacts' forces, or the centre of mass.

    Args:
        robot: The Robot.
        tags: Tags of the component.
        wheels: The wheels.

    Attributes:
        polygon: The support polygon.

    Raises:
        SolferError: The group of the hips does not fit the robot.
    """

    def __init__(self, robot: Robot, tags: SupportShapingTags, wheels: DrivenWheels):
        self._robot = robot
        self._wheels = wheels
        self._base = str(robot.kinematics.base_link)
        self._by_pressure = tags.balance == "center_of_pressure"
        self._ends = tuple(zip(_hips_of(robot, tags, len(wheels.links)), wheels.links, strict=True))
        self._weight = robot.kinematics.mass * float(np.linalg.norm(robot.gravity))
        self._velocity = np.zeros(3)
        self.polygon = FootprintGeometry(len(wheels.links))

    def start(self) -> None:
        """Find the edges of the vertices as they are."""
        self.polygon.start(self._wheels.offsets.states)
        self.update()

    def update(self) -> None:
        """Compute margins and distances of this cycle."""
        kinematics = self._robot.kinematics
        x, y, _ = self.balance().tolist()
        self.polygon.update(self._wheels.offsets.states.tolist(), self._seen_from_base(x, y))
        heading = self._wheels.offsets.heading
        legs = []
        for hip, wheel in self._ends:
            hx, hy, hz = kinematics.position(hip).tolist()
            wx, wy, wz = kinematics.position(wheel).tolist()
            legs.append((*seen_from(heading, hx - wx, hy - wy), hz - wz))
        self.polygon.measure_legs(legs)

    def balance(self) -> np.ndarray:
        """Return the balance in the world, shape (3,) [m]."""
        robot = self._robot
        if self._by_pressure:
            pressed = sum(max(float(robot.contacts[wheel.name].force[2]), 0.0) for wheel in self._wheels.contacts)
            if pressed >= 0.2 * self._weight:
                return robot.center_of_pressure.value
        return robot.center_of_mass.value

    def measure_center(self) -> tuple[tuple[float, float, float], tuple[float, float]]:
        """Return the centre of mass, its height over the ground, and its velocity, all seen from the heading."""
        center = self._robot.center_of_mass
        np.dot(center.jacobian, self._robot.state.velocity, out=self._velocity)
        x, y, z = center.value.tolist()
        vx, vy, _ = self._velocity.tolist()
        ground = float(self._wheels.offsets.states[:, 2].min())
        return (*self._seen_from_base(x, y), z - ground), seen_from(self._wheels.offsets.heading, vx, vy)

    def _seen_from_base(self, x: float, y: float) -> tuple[float, float]:
        """Return a place of the world as seen from the base [m]."""
        px, py, _ = self._robot.kinematics.position(self._base).tolist()
        return seen_from(self._wheels.offsets.heading, x - px, y - py)


def _hips_of(robot: Robot, tags: SupportShapingTags, count: int) -> list[str]:
    """Return the links of the hips, one for each wheel."""
    try:
        hips = list(robot.links(tags.hips))
    except UnknownName as error:
        raise error.at(tags.where("hips")) from None
    if len(hips) != count:
        raise ComponentError(
            f"{len(hips)} links in '{tags.hips}' for {count} wheels",
            where=tags.where("hips"),
            expected="one for each wheel",
        )
    return hips

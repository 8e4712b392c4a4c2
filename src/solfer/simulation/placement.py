"""Where a robot begins: on the ground that is under it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from solfer.errors import SimulationError
from solfer.simulation.body import Body
from solfer.simulation.world import World

OVERLAP = 1e-5  # [m] into the ground, so that the very first step finds the contacts
TOUCH = 2e-7  # [m], distance at which the approach to the ground ends; PyBullet measures in single precision
APPROACHES = 2000


@dataclass(frozen=True)
class Placement:
    """Where a floating base is put.

    Attributes:
        x, y: Position of the base link's origin in the world [m].
        yaw: Direction in which it looks, from x [rad].
        height: Distance of the lowest shape from what is under the robot [m]; zero: it touches.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    height: float = 0.0

    def check(self) -> None:
        """Make sure that a robot can be put there.

        Raises:
            SimulationError: A number is not finite, or the height negative.
        """
        for name, value in vars(self).items():
            if not math.isfinite(value):
                raise SimulationError(f"'{name}' is {value:g}", expected="a finite number")
        if self.height < 0.0:
            raise SimulationError(f"'height' is {self.height:g}", expected="zero or more [m]")


ORIGIN = Placement()


def put(body: Body, world: World, joints: Sequence[float], placement: Placement) -> None:
    """Put a floating robot down, upright on the ground, at rest.

    It comes from above and moves down by its distance from the world until it touches: no step is longer than the
    free way (conservative advancement), so that it stops at the first contact.

    Raises:
        SimulationError: It does not come to the ground.
    """
    orientation = world.orientation(placement.yaw)
    body.place(joints, (placement.x, placement.y, 0.0), orientation)
    low, high = body.extent()
    obstacles, top = world.under(low, high)
    if not obstacles:
        body.place(joints, (placement.x, placement.y, placement.height - low[2]), orientation)
        return
    height = top - low[2]
    for _ in range(APPROACHES):
        body.place(joints, (placement.x, placement.y, height), orientation)
        distance = body.distance(obstacles)
        if abs(distance) < TOUCH:
            break
        height -= distance
    else:
        raise SimulationError(f"there is no place for the robot at x {placement.x:g}, y {placement.y:g}")
    body.place(joints, (placement.x, placement.y, height + (placement.height or -OVERLAP)), orientation)

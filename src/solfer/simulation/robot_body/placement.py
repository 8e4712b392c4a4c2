"""Where a robot begins: on the ground below it."""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solfer.errors import SimulationError
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation.robot_body.body import Body
from solfer.simulation.robot_body.resting import resting_orientation, rests
from solfer.simulation.world.world import World


@dataclass(frozen=True)
class StartPlacement:
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
        """Check that a robot can be put there.

        Raises:
            SimulationError: A number is not finite, or beyond its bounds.
        """
        bounds = {
            "x": (-1000.0, 1000.0, "m"),
            "y": (-1000.0, 1000.0, "m"),
            "yaw": (-100.0, 100.0, "rad"),
            "height": (0.0, 100.0, "m"),
        }
        for name, (low, high, unit) in bounds.items():
            value = getattr(self, name)
            if not low <= value <= high:  # true for NaN as well
                raise SimulationError(f"'{name}' is {value:g}", expected=f"from {low:g} to {high:g} [{unit}]")


START_ORIGIN = StartPlacement()
logger = logging.getLogger(__name__)


def put(body: Body, world: World, joints: Sequence[float] | np.ndarray, placement: StartPlacement) -> None:
    """Put a floating robot down, upright on the ground, at rest.

    Upright on a plane it may have to fall over at once, because its soles are not flat: then it is tilted by as little
    as lets it rest on them, if that is little.

    Raises:
        SimulationError: It does not come to the ground, or has nothing to stand on.
    """
    upright = world.orientation(placement.yaw)
    obstacles = _put_down(body, world, joints, placement=placement, orientation=upright)
    if obstacles != [world.ground] or rests(body, obstacles[0], rotation_from_quaternion(upright)[:, 2]):
        return
    tilted = resting_orientation(body, joints, upright, ground=obstacles[0])
    _put_down(body, world, joints, placement=placement, orientation=upright if tilted is None else tilted)
    if tilted is not None:
        logger.warning(
            "the robot begins tilted by %.1f degrees: upright, its centre of mass is not above what touches the ground",
            math.degrees(2.0 * math.acos(min(1.0, abs(float(upright @ tilted))))),
        )


def _put_down(
    body: Body,
    world: World,
    joints: Sequence[float] | np.ndarray,
    placement: StartPlacement,
    orientation: np.ndarray,
) -> list[int]:
    """Put a robot down in an orientation, and return the bodies of the world below it.

    It comes from above and moves down by its distance from the world until it touches: no step is longer than the
    free way (conservative advancement), so that it stops at the first contact.
    """
    body.place(joints, (placement.x, placement.y, 0.0), orientation)
    low, high = body.extent()
    obstacles, top = world.under(low, high)
    if not obstacles:
        body.place(joints, (placement.x, placement.y, placement.height - low[2]), orientation)
        return obstacles
    height = top - low[2]
    for _ in range(2000):
        body.place(joints, (placement.x, placement.y, height), orientation)
        distance = body.distance(obstacles)
        if math.isinf(distance):
            raise SimulationError(
                "nothing carries the robot: its base floats, and it has no collision shapes",
                expected="<collision> elements in its URDF, or `floating_base: false`",
            )
        if abs(distance) < 2e-7:  # [m]; engines measure in single precision
            break
        height -= distance
    else:
        raise SimulationError(
            f"there is no place for the robot at x {placement.x:g}, y {placement.y:g}",
            expected="a place that is free of obstacles and inside of the world",
        )
    overlap = 1e-5  # [m] into the ground, so that the very first step finds the contacts
    body.place(joints, (placement.x, placement.y, height + (placement.height or -overlap)), orientation)
    return obstacles


def sunk(body: Body, world: World) -> str:
    """Return which link of a robot with a fixed base is inside of the world, which pushes it out; empty: none."""
    if body.floating:
        return ""
    obstacles, _ = world.under(*body.extent())
    depth, link = body.overlap(obstacles)
    if depth <= 1e-3:  # [m]; a smaller overlap is a matter of rounding
        return ""
    return (
        f"link '{link}' begins {depth:.3f} m inside of the world, which pushes it out: the base is fixed at z = 0; "
        "a link below the root of the URDF raises it"
    )

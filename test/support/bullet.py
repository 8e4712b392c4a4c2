"""PyBullet behind a simulation, for tests whose subject or measure it is; all others ask the engine's protocol."""

from typing import Any, NamedTuple

import pytest

from solfer.simulation import Simulation
from solfer.simulation.bullet import load_pybullet

pytest.importorskip("pybullet", reason="PyBullet has no wheel for this Python")


class RawBullet(NamedTuple):
    """What calls of PyBullet need.

    Attributes:
        module: PyBullet.
        client: Number of the client.
        body: Number of the robot's body.
        joints: PyBullet's numbers of the joints, in the model's order.
        links: PyBullet's numbers of its links.
    """

    module: Any
    client: int
    body: int
    joints: list[int]
    links: dict[str, int]


def raw_bullet(simulation: Simulation) -> RawBullet:
    robot = simulation.body.robot
    client = robot._world.number
    return RawBullet(load_pybullet(), client, robot.number, joints=robot._indices, links=robot._numbers)

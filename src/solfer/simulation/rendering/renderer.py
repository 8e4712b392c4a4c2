"""Pictures of a robot, without a display."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from solfer.errors import SimulationError, writing
from solfer.model.kinematics import Kinematics
from solfer.model.urdf.description import Description
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation.engines import make_engine
from solfer.simulation.physics import CameraView, Pose
from solfer.simulation.robot_body.body import Body
from solfer.simulation.simulation import Simulation
from solfer.simulation.world.records import Friction, WorldRecord
from solfer.simulation.world.world import FLAT_WORLD, World

TILE_SIZE = 0.5
"""Edge of a tile of the floor [m]."""

TILE_COUNT = 20
"""Tiles along each side of the floor."""

TILE_HEIGHT = 0.01
"""Height of a tile [m]."""


class Renderer:
    """Draws a robot in a world of its own, so that no simulation is touched.

    Args:
        description: The robot.
        kinematics: Its model.
        width: Width of the pictures [pixel].
        height: Height of the pictures [pixel].
        yaw: Direction in which the camera looks, about the vertical [deg]; 90: along -x, at the robot's front.
        pitch: Inclination of the camera [deg], negative downwards.
        world: The surroundings of the robot.

    Raises:
        SimulationError: The robot cannot be loaded.
    """

    def __init__(
        self,
        description: Description,
        kinematics: Kinematics,
        width: int = 960,
        height: int = 720,
        yaw: float = 130.0,
        *,
        pitch: float = -20.0,
        world: WorldRecord = FLAT_WORLD,
    ):
        self._size = (width, height)
        self._angles = (yaw, pitch)
        self._chart = kinematics.base
        self._engine = make_engine(draws=True)
        self._body = Body(self._engine, description, kinematics, motors=np.zeros(0, dtype=np.intp), friction=Friction())
        self._first = kinematics.size - len(self._body.joints)
        self._world = World(self._engine, world)
        self._floor = self._make_floor()

    def image(self, q: np.ndarray, boxes: Sequence[Pose] = ()) -> np.ndarray:
        """Draw the robot at position q of the model's DoFs: RGB, shape (height, width, 3), uint8.

        The boxes of the world that can move stand at the poses `boxes`; without any they stay where they are.
        """
        if boxes:
            self._world.place(boxes)
        pose = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)) if self._chart is None else self._chart.to_pose(q[:6])
        self._body.place(q[self._first :], *pose)
        samples = 2  # rays along each side of a pixel
        width, height = (samples * side for side in self._size)
        yaw, pitch = self._angles
        low, high = self._body.extent()
        centre = ((low + high) / 2.0).tolist()
        size = float((high - low).max())
        self._move_floor(centre)
        margin = 1.6  # what is seen, over the extent of the robot
        field_of_view = 40.0  # vertical [deg]
        distance = margin * size / 2.0 / math.tan(math.radians(field_of_view / 2.0))
        picture = self._engine.render(
            CameraView(centre, distance, yaw, pitch=pitch, field_of_view=field_of_view, size=(width, height))
        )
        begin = 1.2  # where the floor begins to fade, over the distance of the robot
        end = 2.0  # where it has faded into the sky
        haze = np.clip((picture.depth / distance - begin) / (end - begin), 0.0, 1.0)
        haze[picture.is_empty] = 1.0
        fraction = np.linspace(1.0, 0.0, height)[:, None, None]
        lower = np.array([250.0, 251.0, 253.0])  # RGB of the sky at the edges of the picture
        upper = np.array([206.0, 216.0, 228.0])
        sky = fraction * upper + (1.0 - fraction) * lower
        fine = picture.colours + haze[:, :, None] * (sky - picture.colours)
        blocks = fine.reshape(height // samples, samples, width // samples, samples, 3)
        return blocks.mean(axis=(1, 3)).astype(np.uint8)

    def save(self, q: np.ndarray, path: str | Path, boxes: Sequence[Pose] = ()) -> None:
        """Write the picture at q, see `image`, to a PNG file.

        Raises:
            SimulationError: The file cannot be written.
        """
        with writing("the picture", path, SimulationError), open(path, "wb") as file:
            self.write(q, file, boxes)

    def write(self, q: np.ndarray, file: BinaryIO, boxes: Sequence[Pose] = ()) -> None:
        """Write the picture at q, see `image`, as PNG into an open file."""
        from matplotlib.image import imsave  # heavy, and needed here only

        imsave(file, self.image(q, boxes), format="png")

    def close(self) -> None:
        """Release the world. May be called twice."""
        self._engine.close()

    def _make_floor(self) -> list[int]:
        """Add tiles below the plane of the ground, if there is one, which are visual only; return their bodies."""
        if not self._world.record.ground.exists:
            return []
        pair = ((0.80, 0.82, 0.84, 1.0), (0.72, 0.74, 0.77, 1.0))
        colours = [pair[(row + column) % 2] for row in range(TILE_COUNT) for column in range(TILE_COUNT)]
        return self._engine.add_tiles((TILE_SIZE, TILE_SIZE, TILE_HEIGHT), colours)

    def _move_floor(self, centre: Sequence[float]) -> None:
        """Move the tiles below the robot, by whole pairs of them, so that the pattern stands still."""
        orientation = self._world.orientation()
        rotation = rotation_from_quaternion(orientation)
        x, y, _ = centre @ rotation
        pair = 2.0 * TILE_SIZE
        first = 0.5 * (1 - TILE_COUNT) * TILE_SIZE
        for number, tile in enumerate(self._floor):
            row, column = divmod(number, TILE_COUNT)
            place = [
                pair * round(x / pair) + first + row * TILE_SIZE,
                pair * round(y / pair) + first + column * TILE_SIZE,
                -TILE_HEIGHT / 2.0,
            ]
            self._engine.place(tile, (rotation @ place, orientation))


def render(simulation: Simulation, path: str | Path) -> None:
    """Write a picture of a simulation's robot as it stands now to a PNG file.

    Raises:
        SimulationError: The file cannot be written.
    """
    renderer = Renderer(simulation.kinematics.description, simulation.kinematics)
    try:
        renderer.save(simulation.q, path)
    finally:
        renderer.close()

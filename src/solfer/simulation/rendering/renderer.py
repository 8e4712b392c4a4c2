"""Pictures of a robot, without a display."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from solfer.errors import SimulationError
from solfer.model.kinematics import Kinematics
from solfer.model.urdf.description import Description
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation.bullet import BulletEngine
from solfer.simulation.physics import CameraView, Pose
from solfer.simulation.robot_body.body import Body
from solfer.simulation.simulation import Simulation
from solfer.simulation.world.records import Friction, WorldRecord
from solfer.simulation.world.world import FLAT_WORLD, World

RENDERER_FIELD_OF_VIEW = 40.0  # [deg], vertical
RENDERER_MARGIN = 1.6  # what is seen, over the extent of the robot
RENDERER_SAMPLES = 2  # rays along each side of a pixel
HAZE = (1.2, 2.0)
"""Distances at which the floor begins to fade, and has faded into the sky, over that of the robot."""

FLOOR_TILE = 0.5  # [m]
FLOOR_TILES = 20  # along each side
FLOOR_TILE_HEIGHT = 0.01  # [m]
FLOOR_COLOURS = ((0.80, 0.82, 0.84, 1.0), (0.72, 0.74, 0.77, 1.0))
SKY = np.array([[250.0, 251.0, 253.0], [206.0, 216.0, 228.0]])  # RGB at the lower and at the upper edge


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
        self._engine = BulletEngine()
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
        width, height = (RENDERER_SAMPLES * side for side in self._size)
        yaw, pitch = self._angles
        centre, size = self._extent()
        self._move_floor(centre)
        distance = RENDERER_MARGIN * size / 2.0 / math.tan(math.radians(RENDERER_FIELD_OF_VIEW / 2.0))
        picture = self._engine.render(
            CameraView(centre, distance, yaw, pitch=pitch, field_of_view=RENDERER_FIELD_OF_VIEW, size=(width, height))
        )
        haze = np.clip((picture.depth / distance - HAZE[0]) / (HAZE[1] - HAZE[0]), 0.0, 1.0)
        haze[picture.is_empty] = 1.0
        share = np.linspace(1.0, 0.0, height)[:, None, None]
        sky = share * SKY[1] + (1.0 - share) * SKY[0]
        fine = picture.colours + haze[:, :, None] * (sky - picture.colours)
        blocks = fine.reshape(
            height // RENDERER_SAMPLES, RENDERER_SAMPLES, width // RENDERER_SAMPLES, RENDERER_SAMPLES, 3
        )
        return blocks.mean(axis=(1, 3)).astype(np.uint8)

    def save(self, q: np.ndarray, path: str | Path, boxes: Sequence[Pose] = ()) -> None:
        """Write the picture at q, see `image`, to a PNG file.

        Raises:
            SimulationError: The file cannot be written.
        """
        try:
            with open(path, "wb") as file:
                self.write(q, file, boxes)
        except OSError as error:
            raise SimulationError(
                f"the picture cannot be written: {error.strerror}",
                where=str(path),
                expected="a file that you may write to",
            ) from error

    def write(self, q: np.ndarray, file: BinaryIO, boxes: Sequence[Pose] = ()) -> None:
        """Write the picture at q, see `image`, as PNG into an open file."""
        from matplotlib.image import imsave  # heavy, and needed here only

        imsave(file, self.image(q, boxes), format="png")

    def close(self) -> None:
        """Release the world. May be called twice."""
        self._engine.close()

    def _extent(self) -> tuple[list[float], float]:
        """Compute the centre of the robot [m] and its largest extent [m]."""
        low, high = self._body.extent()
        return ((low + high) / 2.0).tolist(), float((high - low).max())

    def _make_floor(self) -> list[int]:
        """Add tiles below the plane of the ground, which are visual only; return their bodies."""
        colours = [FLOOR_COLOURS[(row + column) % 2] for row in range(FLOOR_TILES) for column in range(FLOOR_TILES)]
        return self._engine.add_tiles((FLOOR_TILE, FLOOR_TILE, FLOOR_TILE_HEIGHT), colours)

    def _move_floor(self, centre: Sequence[float]) -> None:
        """Move the tiles below the robot, by whole pairs of them, so that the pattern stands still."""
        orientation = self._world.orientation()
        rotation = rotation_from_quaternion(orientation)
        x, y, _ = centre @ rotation
        pair = 2.0 * FLOOR_TILE
        first = 0.5 * (1 - FLOOR_TILES) * FLOOR_TILE
        for number, tile in enumerate(self._floor):
            row, column = divmod(number, FLOOR_TILES)
            place = [
                pair * round(x / pair) + first + row * FLOOR_TILE,
                pair * round(y / pair) + first + column * FLOOR_TILE,
                -FLOOR_TILE_HEIGHT / 2.0,
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

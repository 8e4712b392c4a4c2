"""The world that a simulated robot stands in, as surfaces."""

import logging
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from solfer.errors import SolferError, UnknownName
from solfer.numerics.rotations import rotation_from_rpy
from solfer.simulation.world.grids import Grid
from solfer.simulation.world.records import BoxRecord, GridRecord, WorldRecord
from solfer.simulation.world.world import WORLD_FILE, read_world, steps_of
from solfer.transport import Middleware

MOST_SQUARES = 128
"""Most squares of a grid that are drawn along x, and along y."""

PERIOD = 2.0
"""Time from one look for a world to the next [s]."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class WorldSurface:
    """Triangles in the world.

    Attributes:
        name: Name of what they belong to.
        vertices: Shape (n, 3) [m].
        faces: Indices of their corners, shape (k, 3).
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray


class ShownWorld:
    """Finds the world of the simulation that runs.

    Args:
        middleware: Has its parameters.
    """

    def __init__(self, middleware: Middleware):
        self._middleware = middleware
        self._due = -math.inf
        self._file = ""

    def update(self) -> Sequence[WorldSurface] | None:
        """Return what is seen of the world; None: it has not changed."""
        now = self._middleware.now()
        if now < self._due:
            return None
        self._due = now + PERIOD
        try:
            file = str(self._middleware.parameter(WORLD_FILE))
        except UnknownName:
            file = ""
        except SolferError:  # the page and the node `scene` survive those whom they show
            return None
        if file == self._file:
            return None
        self._file = file
        try:
            return list(surfaces_of(read_world(file))) if file else ()
        except SolferError as error:
            logger.warning("the world is not shown: %s", error)
            return ()


def surfaces_of(world: WorldRecord) -> Iterator[WorldSurface]:
    """Make the surfaces of all that does not move, without level ground.

    Raises:
        ConfigError, UnknownName: There are no such heights.
    """
    slope = world.ground.slope
    if world.ground.exists and slope:
        corners = 10.0 * np.array([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)])
        tilted = corners @ rotation_from_rpy((0.0, -slope, 0.0)).T
        yield WorldSurface("ground", tilted, np.array([(0, 1, 2), (0, 2, 3)]))
    for name, grid in world.grids.items():
        yield _grid(name, grid)
    for name, stairs in world.stairs.items():
        for number, step in enumerate(steps_of(stairs), start=1):
            yield _box(f"{name}/{number}", step)
    for name, box in world.boxes.items():
        if box.mass is None:
            yield _box(name, box)


def _grid(name: str, record: GridRecord) -> WorldSurface:
    heights = Grid(record).heights
    rows, columns = (np.linspace(0, n - 1, min(n, MOST_SQUARES + 1)).round().astype(int) for n in heights.shape)
    x, y = np.meshgrid(rows, columns, indexing="ij")
    middle = 0.5 * (np.array(heights.shape) - 1.0)
    places = np.stack((record.spacing * (x - middle[0]), record.spacing * (y - middle[1]), heights[x, y]), axis=-1)
    vertices = places.reshape(-1, 3) @ rotation_from_rpy((0.0, 0.0, record.yaw)).T + record.position
    numbers = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (each.ravel() for each in (numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]))
    return WorldSurface(name, vertices, np.concatenate((np.stack((a, b, c), axis=1), np.stack((a, c, d), axis=1))))


CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
"""Corners of a cube with edges of 1, shape (8, 3)."""

SIDES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
"""Corners of its sides, against the clock as seen from outside."""


def _box(name: str, box: BoxRecord) -> WorldSurface:
    vertices = (CORNERS * box.size) @ rotation_from_rpy(box.rpy).T + box.position
    return WorldSurface(name, vertices, np.concatenate((SIDES[:, [0, 1, 2]], SIDES[:, [0, 2, 3]])))

"""Heights of a ground that is known in advance."""

import numpy as np
from scipy.ndimage import map_coordinates

from solfer.numerics.rotations import rotation_from_rpy
from solfer.simulation.world.grids import Grid
from solfer.simulation.world.records import BoxRecord, WorldRecord
from solfer.simulation.world.world import steps_of


class Terrain:
    """The ground of a world, seen from above.

    Args:
        record: The world. Boxes that can move are walls: no wheel may stand on them.
    """

    def __init__(self, record: WorldRecord):
        self._ground = record.ground
        self._grids = [(Grid(each).heights, each) for each in record.grids.values()]
        self._boxes = [*record.boxes.values()]
        for stairs in record.stairs.values():
            self._boxes.extend(steps_of(stairs))

    def heights(self, places: np.ndarray) -> np.ndarray:
        """Compute the heights at places x and y, shape (n, 2) [m].

        Returns:
            Shape (n,) [m]: minus infinity where there is no ground, infinity on what can move.
        """
        if self._ground.exists:
            heights = np.tan(self._ground.slope) * places[:, 0]
        else:
            heights = np.full(len(places), -np.inf)
        for box in self._boxes:
            tops = _tops(box, places)
            np.maximum(heights, tops if box.mass is None else np.where(np.isfinite(tops), np.inf, -np.inf), out=heights)
        for grid, record in self._grids:
            turn = rotation_from_rpy((0.0, 0.0, record.yaw))[:2, :2]
            squares = (places - record.position[:2]) @ turn / record.spacing + 0.5 * (np.array(grid.shape) - 1.0)
            tops = map_coordinates(grid, squares.T, order=1, cval=-np.inf)
            np.maximum(heights, tops + record.position[2], out=heights)
        return heights


def _tops(box: BoxRecord, places: np.ndarray) -> np.ndarray:
    """Compute where vertical lines leave a box, shape (n,) [m]; minus infinity: they miss it."""
    rotation = rotation_from_rpy(box.rpy)
    half = 0.5 * np.array(box.size)
    begin = np.column_stack((places, np.zeros(len(places)))) - box.position
    begin = begin @ rotation
    along = rotation[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.sort(((-half - begin) / along, (half - begin) / along), axis=0)
    enters = np.fmax.reduce(ends[0], axis=1)
    leaves = np.fmin.reduce(ends[1], axis=1)
    return np.where(enters <= leaves, leaves, -np.inf)

"""Grids of heights: where they come from, and what of them lies below a box."""

import math
from io import BytesIO

import numpy as np

from solfer.config import FileRecord
from solfer.config.yaml.files import check_file
from solfer.errors import ConfigError
from solfer.files import read_bytes
from solfer.numerics.rotations import rotation_from_rpy
from solfer.simulation.world.records import HIGHEST, MOST_HEIGHTS, GridRecord, UnevenRecord

SHAPE = f"rows of equal length, from 2 x 2 to {MOST_HEIGHTS} x {MOST_HEIGHTS} numbers"


class Grid:
    """Heights at the corners of equal squares.

    Args:
        record: What it is.

    Attributes:
        heights: Rows along x of numbers along y, shape (n, m) [m].

    Raises:
        ConfigError: There are no such heights.
        UnknownName: The file lies in a ROS package that there is not.
    """

    def __init__(self, record: GridRecord):
        self._record = record
        if record.uneven is not None:
            self.heights = _uneven(record.uneven, record.spacing)
        elif record.file is not None:
            self.heights = _stored(record.file, record.where("file"))
        else:
            self.heights = _listed(record)

    def top(self, low: np.ndarray, high: np.ndarray) -> float | None:
        """Compute the height [m] above which no square is that touches a box seen from above; None: none touches it.

        Args:
            low: Lower corner of the box in the world, shape (3,) [m].
            high: Upper corner of the box, shape (3,) [m].
        """
        record = self._record
        corners = np.array([(x, y, 0.0) for x in (low[0], high[0]) for y in (low[1], high[1])])
        middle = 0.5 * (np.array(self.heights.shape) - 1.0)
        turned = (corners - record.position) @ rotation_from_rpy((0.0, 0.0, record.yaw))
        places = turned[:, :2] / record.spacing + middle
        begin = np.floor(places.min(axis=0)).astype(int)
        end = np.ceil(places.max(axis=0)).astype(int) + 1
        if np.any(end < 2) or np.any(begin > np.array(self.heights.shape) - 2):
            return None
        (row, column), (last_row, last_column) = np.maximum(begin, 0), end
        return float(self.heights[row:last_row, column:last_column].max()) + record.position[2]


def _listed(record: GridRecord) -> np.ndarray:
    """Read the heights of the world file.

    Raises:
        ConfigError: A row is longer or shorter than the first one.
    """
    rows = record.heights or ()
    for index, row in enumerate(rows):
        if len(row) != len(rows[0]):
            what = f"row {index + 1} has {len(row)} heights, and the first one has {len(rows[0])}"
            raise ConfigError(what, where=record.where("heights", index), expected=SHAPE)
    return np.array(rows)


def _stored(record: FileRecord, where: str) -> np.ndarray:
    """Read the heights of a file of numpy, which is named at the place `where`.

    Raises:
        ConfigError: It is missing, or contains something else.
        UnknownName: It lies in a ROS package that there is not.
    """
    path = record.location
    check_file(path, where)
    try:
        heights = np.lib.format.read_array(BytesIO(read_bytes(path)), allow_pickle=False)
    except (OSError, ValueError, MemoryError) as error:
        raise ConfigError(f"cannot read '{path}': {error}", where=where, expected="a file of `numpy.save`") from error
    if heights.dtype.kind not in "fiu":
        raise ConfigError(f"'{path}' has an array of {heights.dtype}", where=where, expected="an array of numbers")
    if heights.ndim != 2 or not all(2 <= count <= MOST_HEIGHTS for count in heights.shape):
        raise ConfigError(f"'{path}' has an array of the shape {heights.shape}", where=where, expected=SHAPE)
    wrong = np.argwhere(~(np.abs(heights.astype(float)) <= HIGHEST))  # true for NaN as well
    if len(wrong):
        place = tuple(wrong[0].tolist())
        what = f"'{path}' has the height {heights[place]} at {list(place)}"
        raise ConfigError(what, where=where, expected=f"finite heights of at most {HIGHEST:g} m")
    return heights.astype(float)


def _uneven(record: UnevenRecord, spacing: float) -> np.ndarray:
    """Add waves of random directions, and scale them to the height or the slope that is reached first.

    Raises:
        ConfigError: The size is too small or too large for the spacing.
    """
    counts = [round(size / spacing) + 1 for size in record.size]
    if not all(2 <= count <= MOST_HEIGHTS for count in counts):
        what = f"the size has {counts[0]} x {counts[1]} heights at a spacing of {spacing:g} m"
        raise ConfigError(what, where=record.where("size"), expected=SHAPE)
    x, y = np.meshgrid(*(spacing * np.arange(count) for count in counts), indexing="ij")
    random = np.random.default_rng(record.seed)
    heights = np.zeros(counts)
    for _ in range(12):
        direction = random.uniform(0.0, 2.0 * math.pi)
        phase = random.uniform(0.0, 2.0 * math.pi)
        turns = random.uniform(1.0, 2.0) / record.length  # of the wave in a metre, times two: half waves are hills
        heights += np.sin(math.pi * turns * (math.cos(direction) * x + math.sin(direction) * y) + phase)
    heights -= heights.min()
    scales = record.height / heights.max(), record.height / record.length / steepest(heights, spacing)
    return min(scales) * heights


def steepest(heights: np.ndarray, spacing: float) -> float:
    """Compute a slope that no triangle of a grid exceeds.

    Args:
        heights: Rows along x of numbers along y, shape (n, m) [m].
        spacing: Distance between neighbours [m].
    """
    along_x = np.abs(np.diff(heights, axis=0))
    along_y = np.abs(np.diff(heights, axis=1))
    rise = np.maximum(along_x[:, :-1], along_x[:, 1:]), np.maximum(along_y[:-1], along_y[1:])
    return float(np.hypot(*rise).max()) / spacing

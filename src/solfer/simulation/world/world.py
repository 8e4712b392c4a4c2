"""The ground and what stands on it."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from solfer.config import read
from solfer.config.yaml.files import located
from solfer.errors import UnknownName
from solfer.numerics.rotations import quaternion_from_rotation, rotation_from_rpy
from solfer.simulation.physics import Colour, PhysicsEngine, Pose
from solfer.simulation.world.grids import Grid
from solfer.simulation.world.records import GROUND_NAME, BoxRecord, GridRecord, StairsRecord, WorldRecord

FLAT_WORLD = WorldRecord()
WORLD_FILE = "/world_file"
"""Parameter with the file of the world in which a robot is simulated."""

COLOUR: Colour = (0.58, 0.55, 0.50, 1.0)
"""What is seen of a world."""


def find_world(name: str) -> Path:
    """Find the file of a world of this package, or the file itself.

    Raises:
        UnknownName: There is no world of that name.
    """
    if "/" in name or name.endswith(".yaml"):
        return Path(name)
    folder = located("package://solfer/config/worlds", ".")
    known = sorted(path.stem for path in folder.glob("*.yaml"))
    if name not in known:
        raise UnknownName("world", name, known)
    return folder / f"{name}.yaml"


def read_world(path: str | Path) -> WorldRecord:
    """Read the file of a world.

    Raises:
        ConfigError, UnknownName, SolferErrors: The file or one of its grids is missing, or something in them is wrong.
    """
    world = read(path, WorldRecord)
    for grid in world.grids.values():
        Grid(grid)
    return world


class World:
    """Everything in a world but the robot.

    Args:
        engine: Where it is made.
        record: What it is.
        ground_friction: Friction coefficient of a ground that has none of its own; None: the ground is left out.

    Attributes:
        record: What it was made of.
    """

    def __init__(self, engine: PhysicsEngine, record: WorldRecord = FLAT_WORLD, ground_friction: float | None = None):
        self._engine = engine
        self.record = record
        self._slope = record.ground.slope
        self._bodies: dict[str, list[int]] = {}
        self._movable: list[tuple[int, Pose]] = []
        self._grids: dict[int, Grid] = {}
        if ground_friction is not None and record.ground.exists:
            given = record.ground.friction
            normal = [-math.sin(self._slope), 0.0, math.cos(self._slope)]
            self._bodies[GROUND_NAME] = [engine.add_plane(normal, ground_friction if given is None else given)]
        for name, grid in record.grids.items():
            self._bodies[name] = [self._grid(grid)]
        for name, stairs in record.stairs.items():
            self._bodies[name] = [self._box(step) for step in steps_of(stairs)]
        for name, box in record.boxes.items():
            self._bodies[name] = [self._box(box)]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all that there is; `ground` is the plane."""
        return tuple(self._bodies)

    @property
    def ground(self) -> int | None:
        """Number of the ground; None without one."""
        return self._bodies.get(GROUND_NAME, [None])[0]

    def orientation(self, yaw: float = 0.0) -> np.ndarray:
        """Compute the quaternion (x, y, z, w) of a body upright on the ground, rotated by `yaw` [rad] from its x."""
        tilt = rotation_from_rpy((0.0, -self._slope, 0.0))
        heading = rotation_from_rpy((0.0, 0.0, yaw))
        return quaternion_from_rotation(tilt @ heading)

    def reset(self) -> None:
        """Put everything back to where it was, at rest."""
        for body, pose in self._movable:
            self._engine.place(body, pose)
            self._engine.stop(body)

    def scatter(self) -> None:
        """Put everything that can move far away from everything else."""
        for index, (body, (_, orientation)) in enumerate(self._movable):
            self._engine.place(body, ([0.0, 0.0, 1e3 * (index + 1)], orientation))

    def poses(self) -> list[Pose]:
        """Read positions [m] and quaternions (x, y, z, w) of the boxes that can move, in the order of the record."""
        found = (self._engine.pose(body) for body, _ in self._movable)
        return [(np.array(position), np.array(orientation)) for position, orientation in found]

    def place(self, poses: Sequence[Pose]) -> None:
        """Put the boxes that can move to `poses`."""
        for (body, _), pose in zip(self._movable, poses, strict=True):
            self._engine.place(body, pose)

    def set_friction(self, name: str, coefficient: float) -> None:
        """Change the friction coefficient of one of `names`."""
        for body in self._bodies[name]:
            self._engine.set_friction(body, coefficient)

    def under(self, low: np.ndarray, high: np.ndarray) -> tuple[list[int], float]:
        """Find what a body would meet on its descent.

        Args:
            low: Lower corner of a box around the body, shape (3,) [m].
            high: Upper corner of the box, shape (3,) [m].

        Returns:
            The bodies of the world that lie under the box, or in it; and the height [m] above which none of them is.
        """
        found = []
        tops = []
        for name, ids in self._bodies.items():
            for body in ids:
                if name == GROUND_NAME:
                    top = math.tan(self._slope) * (high[0] if self._slope > 0.0 else low[0])
                elif body in self._grids:
                    highest = self._grids[body].top(low, high)
                    if highest is None:
                        continue
                    top = highest
                else:
                    (x, y, _), (far_x, far_y, top) = self._engine.box_around(body)
                    if x > high[0] or far_x < low[0] or y > high[1] or far_y < low[1]:
                        continue
                found.append(body)
                tops.append(top)
        return found, max(tops, default=0.0)

    def _box(self, box: BoxRecord) -> int:
        pose = np.array(box.position), quaternion_from_rotation(rotation_from_rpy(box.rpy))
        body = self._engine.add_box(box.size, pose, box.mass or 0.0, friction=box.friction, colour=COLOUR)
        if box.mass is not None:
            self._movable.append((body, pose))
        return body

    def _grid(self, record: GridRecord) -> int:
        grid = Grid(record)
        pose = record.position, quaternion_from_rotation(rotation_from_rpy((0.0, 0.0, record.yaw)))
        body = self._engine.add_grid(grid.heights, record.spacing, pose, friction=record.friction, colour=COLOUR)
        self._grids[body] = grid
        return body


def steps_of(stairs: StairsRecord) -> list[BoxRecord]:
    """Make the steps of stairs: boxes that all stand on z = 0 and end at the back of the highest."""
    forward = np.array([math.cos(stairs.yaw), math.sin(stairs.yaw)])
    boxes = []
    for index in range(stairs.count):
        depth = (stairs.count - index) * stairs.tread
        height = (index + 1) * stairs.rise
        x, y = np.array(stairs.position) + (index * stairs.tread + depth / 2.0) * forward
        boxes.append(
            BoxRecord(
                size=(depth, stairs.width, height),
                position=(float(x), float(y), height / 2.0),
                rpy=(0.0, 0.0, stairs.yaw),
                friction=stairs.friction,
            )
        )
    return boxes

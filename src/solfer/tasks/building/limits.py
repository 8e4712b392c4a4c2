"""The limits of a stack of tasks."""

from itertools import product

import numpy as np

from solfer.config.tasks.limits import CollisionsRecord, StackLimitsRecord, WorkspaceRecord
from solfer.config.tasks.stack import StackRecord
from solfer.errors import ConfigError, UnknownName
from solfer.model.collisions.distances import LinkDistances, are_neighbours, pairs_that_may_touch
from solfer.model.neutral_posture import neutral_posture
from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.robot import Robot
from solfer.tasks.building.placed import Faults
from solfer.tasks.building.points import WORLD, PointMaker
from solfer.tasks.collisions import CollisionLimit
from solfer.tasks.constraints import Constraint, TorqueLimits, WorkspaceLimit


class LimitMaker:
    """Makes the limits of a stack.

    Args:
        robot: The Robot.
        record: The stack.
        maker: Makes the points that limits name.
        faults: Receives the mistakes.
    """

    def __init__(self, robot: Robot, record: StackRecord, maker: PointMaker, faults: Faults):
        self._robot = robot
        self._record = record
        self._limits = record.limits
        self._fixed = np.zeros(robot.size, dtype=bool)
        self._workspaces: list[WorkspaceLimit] = []
        self._bounds: list[VelocityBounds] = []
        self._maker = maker
        self._faults = faults
        for name, one in self._limits.workspace.items():
            for link, other in self._pairs(one):
                with faults.at(one):
                    point = maker.place(link, other)
                    limit = WorkspaceLimit(name, point, one.nearest, farthest=one.farthest, weight=one.weight)
                    self._workspaces.append(limit)
        self._collisions: CollisionLimit | None = None
        if self._limits.collisions is not None:
            with faults.at(record.limits, "collisions"):
                self._collisions = self._collision_limit(self._limits.collisions)
        for index, name in enumerate(record.relax or ()):
            with faults.at(record, "relax", index):
                if name not in self._names:
                    raise UnknownName("limit", name, self._names, expected="a limit that this stack has")

    def _collision_limit(self, record: CollisionsRecord) -> CollisionLimit | None:
        kinematics = self._robot.kinematics
        apart = self._robot.semantics.apart
        before = len(self._faults.errors)
        if record.pairs is None:
            posture = neutral_posture(kinematics.twin())
            pairs = pairs_that_may_touch(kinematics.twin(), apart, record.distance, position=posture)
        else:
            pairs = [pair for index in range(len(record.pairs)) for pair in self._named_pairs(record, index)]
            pairs = [pair for pair in dict.fromkeys(pairs) if not are_neighbours(kinematics, *pair)]
        if len(self._faults.errors) > before:
            return None
        if not pairs:
            raise ConfigError("no two links may touch each other", expected="pairs of links that are not neighbours")
        distances = LinkDistances(kinematics, pairs, record.influence)
        return CollisionLimit(distances, self._robot, record.distance, weight=record.weight)

    def _named_pairs(self, record: CollisionsRecord, index: int) -> list[tuple[str, str]]:
        """Return the pairs of links of a pair of links or groups."""
        sides: list[tuple[str, ...]] = []
        for side, name in enumerate(record.pairs[index] if record.pairs else ()):
            with self._faults.at(record, "pairs", index, side):
                links = self._maker.expand(name)
                for link in links:
                    if link not in self._robot.description.links:
                        raise UnknownName(
                            "link or group", name, (*self._robot.description.links, *self._robot.selectors)
                        )
                sides.append(links)
        return [] if len(sides) < 2 else [(one, other) for one, other in product(*sides) if one != other]

    def _pairs(self, record: WorkspaceRecord) -> list[tuple[str, str]]:
        """Return links with what they are near to: one for all, or one for each."""
        sides: list[tuple[str, ...]] = []
        before = len(self._faults.errors)
        for key in ("link", "relative"):
            with self._faults.at(record, key):
                names = (WORLD,) if getattr(record, key) == WORLD else self._maker.expand(getattr(record, key))
                for name in names:
                    if name != WORLD or key == "link":
                        self._maker.pose(name)
                sides.append(names)
        if len(self._faults.errors) > before:
            return []
        links, others = sides
        with self._faults.at(record, "relative"):
            if len(others) not in (1, len(links)):
                raise ConfigError(
                    f"{len(others)} links as 'relative' of {len(links)}", expected="one for all, or one for each"
                )
            return list(zip(links, others * (len(links) if len(others) == 1 else 1), strict=True))
        return []

    @property
    def _names(self) -> tuple[str, ...]:
        given = tuple(key for key in ("torques", "collisions") if getattr(self._limits, key) is not None)
        return (*given, *self._limits.workspace)

    def confine(self, dofs: np.ndarray) -> None:
        """Let no other DoFs move; see `ConfiguredStack.confine`."""
        self._fixed[:] = True
        self._fixed[dofs] = False

    def bounds(self, period: float) -> VelocityBounds:
        """Make the bounds of joint velocities; see `ConfiguredStack.bounds`."""
        kinematics = self._robot.kinematics
        limits = self._limits
        free = np.full(kinematics.size, np.inf)
        speed = kinematics.velocity_limit * limits.speed_scale if limits.speeds else free
        bounds = VelocityBounds(
            kinematics.dofs,
            kinematics.lower_position if limits.joints else -free,
            kinematics.upper_position if limits.joints else free,
            speed=np.where(self._fixed, 0.0, speed),
            horizon=horizon_of(limits, period),
        )
        self._bounds.append(bounds)
        return bounds

    def scale_speeds(self, ratio: float) -> None:
        """Let joints move with a ratio of their largest speeds; see `ConfiguredStack.scale_speeds`."""
        if self._limits.speeds:
            for bounds in self._bounds:
                np.multiply(self._robot.kinematics.velocity_limit, ratio, out=bounds.speed)
                bounds.speed[self._fixed] = 0.0

    def keep_apart(self, distance: float) -> None:
        """Set the least distance of links that may touch [m]."""
        if self._collisions is not None:
            self._collisions.nearest = distance

    def constraints(self, period: float) -> list[Constraint]:
        """Make all other limits for a control cycle of `period` [s]."""
        faults = Faults()
        made = list[Constraint]()
        for workspace in self._workspaces:
            workspace.set_horizon(horizon_of(self._limits, period))
            made.append(workspace)
        if self._collisions is not None:
            self._collisions.set_horizon(horizon_of(self._limits, period))
            made.append(self._collisions)
        torques = self._limits.torques
        if torques is not None:
            with faults.at(torques):
                limit = self._robot.kinematics.effort_limit * torques.scale
                made.append(TorqueLimits(self._robot.dynamics, period, limit, weight=torques.weight))
        for error in faults.errors:
            raise error
        return made


def horizon_of(limits: StackLimitsRecord, period: float) -> float:
    """Return the time within which a joint may reach the end of its range [s]: at least one period."""
    return max(period, limits.horizon or 0.0)

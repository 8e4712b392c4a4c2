"""The points that a stack of tasks names."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from solfer.config.tasks.stack import KINDS, FrameRecord, TaskRecord
from solfer.errors import ConfigError, UnknownName
from solfer.model.contacts import ContactRecord
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.points import (
    POSE,
    AngularMomentum,
    CenterOfMass,
    FrameOrientation,
    GroundFrame,
    LinearPoint,
    LookAt,
    Point,
    Posture,
    RelativePoint,
    SpatialPoint,
    WheelFrame,
    make_contact,
)
from solfer.robot import Robot

WORLD = "world"
"""What is seen from the world is not relative."""

ORIGIN = (0.0, 0.0, 0.0)
"""Origin of a link or frame, in its axes [m]."""


class PointMaker:
    """Makes the points of a stack's tasks and limits; a frame that several are seen from is one point.

    Args:
        robot: The Robot.
        frames: Frames of the stack, by name.
        own: Points of the component, by name.
    """

    def __init__(self, robot: Robot, frames: Mapping[str, FrameRecord], own: Mapping[str, Point]):
        self._robot = robot
        self._frames = frames
        self._own = own
        self._poses: dict[str, Point] = {}
        self._center: Point | None = None

    def expand(self, name: str) -> tuple[str, ...]:
        """Return the links of a group, or the name of a link or frame itself."""
        if name in self._known or name not in self._robot.selectors:
            return (name,)
        links = self._robot.links(name)
        if not links:
            raise ConfigError(f"group '{name}' has no link", expected="a link, a frame, or a group with links")
        return links

    def is_single(self, name: str) -> bool:
        """Return whether a name is that of one link or frame, and not of a group."""
        return name in self._known or name not in self._robot.selectors

    def of(self, task: TaskRecord, link: str, dofs: np.ndarray | None) -> Point:
        """Make what a task moves; `dofs` are those of its posture, shape (m,), None for its default."""
        kind = task.point
        if kind in self._own and kind not in KINDS:
            return self._own[kind]
        if kind not in KINDS:
            raise UnknownName("point", kind, (*KINDS, *self._own))
        return getattr(self, f"_{kind}")(task, link, dofs)

    def place(self, name: str, relative: str = WORLD) -> Point:
        """Make the position of a link or frame in the world, or as seen from another one in its axes [m]."""
        point = self._position_of(name, ORIGIN)
        return point if relative == WORLD else RelativePoint(point, self.pose(relative))

    def pose(self, name: str) -> Point:
        """Return the pose of a link, a frame or a point of the component, always the same one."""
        if name not in self._poses:
            self._poses[name] = self._made_pose(name)
        return self._poses[name]

    def constant(self, name: str, what: str) -> Point:
        """Return a point of the component."""
        if name not in self._own:
            raise UnknownName(what, name, self._own)
        return self._own[name]

    @property
    def _known(self) -> set[str]:
        return {*self._robot.description.links, *self._frames, *self._own}

    def _require(self, name: str) -> None:
        if name not in self._known:
            links = self._robot.description.links
            raise UnknownName("link or frame", name, (*links, *self._frames, *self._own, *self._robot.semantics.groups))

    def _made_pose(self, name: str) -> Point:
        self._require(name)
        if name in self._own and name not in self._frames:
            if self._own[name].space != POSE:
                raise ConfigError(f"the component's point '{name}' is {self._own[name]}", expected="a pose")
            return self._own[name]
        if name not in self._frames:
            return SpatialPoint(name, self._robot)
        frame = self._frames[name]
        if frame.type == "wheel":
            wheel = self._wheel(frame.link)
            return WheelFrame(SpatialPoint(frame.link, self._robot, wheel.position), _axle(wheel))
        if frame.type == "ground":
            return GroundFrame(SpatialPoint(frame.link, self._robot), frame.height, frame.axis)
        return SpatialPoint(frame.link, self._robot, frame.offset, frame.orientation)

    def _wheel(self, link: str) -> ContactRecord:
        """Find the contact of a wheel."""
        wheels = {one.end_frame: one for one in self._robot.contact_records if one.type == "wheel"}
        if link not in wheels:
            raise UnknownName("wheel among the robot's contacts", link, wheels)
        if wheels[link].reference_axis is None:
            make_contact(wheels[link], self._robot)  # says what is missing
        return wheels[link]

    def _fixed(self, name: str, what: str) -> tuple[str, FrameRecord | None]:
        """Return the link that a name is fixed to, and the frame on it, if there is one."""
        self._require(name)
        frame = self._frames.get(name)
        if frame is None and name not in self._own:
            return name, None
        if frame is None or frame.type != "link":
            raise ConfigError(
                f"'{name}', which is not fixed to a link, has no {what} of its own",
                expected="a link, or `point: pose` with `rows`",
            )
        return frame.link, frame

    def _position_of(self, name: str, offset: ArrayLike) -> Point:
        link, frame = self._fixed(name, "position")
        if frame is not None:
            offset = frame.offset + rotation_from_quaternion(np.array(frame.orientation)) @ offset
        return LinearPoint(link, self._robot, offset)

    def _seen(self, point: Point, task: TaskRecord) -> Point:
        """Return a point as its task sees it."""
        if task.relative in (None, WORLD):
            return point
        if task.axes == "world":
            return point - self._position_of(task.relative, ORIGIN)
        return RelativePoint(point, self.pose(task.relative))

    def _position(self, task: TaskRecord, link: str, _: np.ndarray | None) -> Point:
        return self._seen(self._position_of(link, task.offset or ORIGIN), task)

    def _orientation(self, task: TaskRecord, link: str, _: np.ndarray | None) -> Point:
        link, frame = self._fixed(link, "orientation")
        rotation = () if frame is None else (frame.orientation,)
        return self._seen(FrameOrientation(link, self._robot, *rotation), task)

    def _pose(self, task: TaskRecord, link: str, _: np.ndarray | None) -> Point:
        if task.offset is None:
            return self._seen(self.pose(link), task)
        link, frame = self._fixed(link, "offset")
        if frame is None:
            return self._seen(SpatialPoint(link, self._robot, task.offset), task)
        origin = frame.offset + rotation_from_quaternion(np.array(frame.orientation)) @ task.offset
        return self._seen(SpatialPoint(link, self._robot, origin, frame.orientation), task)

    def _center_of_mass(self, task: TaskRecord, *_: object) -> Point:
        self._center = self._center or CenterOfMass(self._robot)
        return self._seen(self._center, task)

    def _angular_momentum(self, *_: object) -> Point:
        return AngularMomentum(self._robot)

    def _posture(self, task: TaskRecord, link: str, dofs: np.ndarray | None) -> Point:
        if dofs is None:
            base = 0 if self._robot.kinematics.base is None else 6
            followers = self._robot.kinematics.tree.followers.dofs
            dofs = np.setdiff1d(np.arange(base, self._robot.size), followers)
        return Posture(self._robot, dofs)

    def _look_at(self, task: TaskRecord, link: str, _: np.ndarray | None) -> Point:
        frame = self.pose(link)
        if isinstance(task.target, str):
            own = self._own.get(task.target)
            return LookAt(frame, self._position_of(task.target, ORIGIN) if own is None else own)
        return LookAt(frame, task.target or ahead(frame, task))

    def _steering(self, task: TaskRecord, link: str, _: np.ndarray | None) -> Point:
        name = f"wheel of {link}"
        if name not in self._poses:
            self._require(link)
            wheel = self._wheel(link)
            self._poses[name] = WheelFrame(SpatialPoint(link, self._robot, wheel.position), _axle(wheel))
        return self._seen(self._poses[name], task)

    def _rolling(self, task: TaskRecord, link: str, _: np.ndarray | None) -> Point:
        self._require(link)
        return make_contact(self._wheel(link), self._robot)


def ahead(frame: Point, task: TaskRecord) -> np.ndarray:
    """Compute the place 1 m ahead of where a task looks, shape (3,) [m]."""
    frame.update()
    axis = np.array(task.axis or (1.0, 0.0, 0.0))
    return frame.value[:3] + rotation_from_quaternion(frame.value[3:]) @ (axis / np.linalg.norm(axis))


def _axle(wheel: ContactRecord) -> tuple[float, float, float]:
    axis = wheel.reference_axis
    return (0.0, 0.0, 1.0) if axis is None else (axis.x, axis.y, axis.z)

"""The wheels that `wheeled_motion` drives on, and the points of its tasks."""

from collections.abc import Sequence

import numpy as np

from solfer.components.wheeled_motion.points import BasePose, Camber, Caster, RollingOffsets, carrier_of
from solfer.components.wheeled_motion.tags import BASE, CAMBER, CASTER, STEERING, TASK_POINTS, VERTICES, DrivingTags
from solfer.errors import ComponentError, UnknownName
from solfer.model.contacts import ContactRecord
from solfer.model.kinematics import Kinematics
from solfer.numerics.planar_move import PlanarMove
from solfer.points import CenterOfMass, Point, SpatialPoint, SupportVertex
from solfer.robot import Robot


class DrivenWheels:
    """The wheels that a component drives on, and the points of its tasks.

    Args:
        robot: The Robot.
        tags: Tags of the component.

    Attributes:
        contacts: Their contacts, in the order of the group.
        links: Their links.
        pose: Pose of the base's link.
        points: The points, by their names in the stack.
        offsets: The vertices, which are one of them.
        steering: DoFs that steer the wheels, shape (m,); empty where no task does.

    Raises:
        SolferError: A tag does not fit the robot.
    """

    def __init__(self, robot: Robot, tags: DrivingTags):
        self._robot = robot
        self.contacts = find_wheels(robot, tags)
        self.links = [wheel.end_frame for wheel in self.contacts]
        self.pose = SpatialPoint(robot.kinematics.base_link, robot)
        self.points = make_points(robot, tags, self.contacts, pose=self.pose)
        self.offsets: RollingOffsets = self.points[TASK_POINTS[VERTICES]]  # type: ignore[assignment]
        steered = any(STEERING in level for level in tags.stack_record().levels)
        dofs = [steered_by(robot, tags, wheel) for wheel in self.contacts] if steered else []
        self.steering = np.array(dofs, dtype=int)

    @property
    def place(self) -> np.ndarray:
        """Place of the base that is tracked, shape (3,) [m]; live."""
        return self.points[TASK_POINTS[BASE]].value[3:]

    @property
    def center(self) -> CenterOfMass:
        """Centre of mass, up to date with the points."""
        return self.points[TASK_POINTS[BASE]].center  # type: ignore[attr-defined]

    @property
    def kinematics(self) -> Kinematics:
        """Kinematics of the robot."""
        return self._robot.kinematics

    @property
    def position(self) -> np.ndarray:
        """Position of the robot, shape (n,); live."""
        return self._robot.state.position

    @property
    def is_whole(self) -> bool:
        """Whether that is the centre of mass of the whole robot."""
        return self._robot.is_whole

    def find_legs(self, moved: np.ndarray) -> dict[str, int]:
        """Return the DoFs among the moved ones, shape (m,), that neither drive nor steer a wheel, by their names."""
        robot = self._robot
        driving = {robot.dof(robot.description.links[link].parent) for link in self.links}
        driving.update(self.steering.tolist())
        return {robot.dofs[dof]: dof for dof in moved.tolist() if dof >= 6 and dof not in driving}

    def measure_forces(self) -> np.ndarray:
        """Return the vertical forces on the wheels that a pipe receives, shape (m,) [N]; without one zeros."""
        contacts = self._robot.contacts
        return np.array([contacts[wheel.name].wrench[2] for wheel in self.contacts])

    def displace(self, move: PlanarMove) -> None:
        """Move with the base, whose estimate has jumped."""
        self.offsets.displace(move)
        move.move(self.pose.value[:3])
        move.rotate_orientation(self.pose.value[3:])


def find_wheels(robot: Robot, tags: DrivingTags) -> tuple[ContactRecord, ...]:
    """Return the contacts of the tracked wheels, in the order of the group.

    Raises:
        ComponentError: The robot has a fixed base, or the group no wheels.
        UnknownName: There is no such group, or a link of it is no wheel.
    """
    if robot.kinematics.base_link is None:
        raise ComponentError(f"'{robot.name}' has a fixed base", where=tags.where(), expected="a floating base")
    records = {one.end_frame: one for one in robot.contact_records if one.type == "wheel"}
    try:
        links = robot.links(tags.track)
    except UnknownName as error:
        raise error.at(tags.where("track")) from None
    for link in links:
        if link not in records:
            raise UnknownName("wheel among the robot's contacts", link, records, where=tags.where("track"))
    if not links:
        raise ComponentError(f"no wheel in '{tags.track}'", where=tags.where("track"), expected="links of wheels")
    return tuple(records[link] for link in links)


def make_points(
    robot: Robot, tags: DrivingTags, wheels: Sequence[ContactRecord], pose: SpatialPoint
) -> dict[str, Point]:
    """Make the points of the tasks by their names in the stack; `pose` is that of the base's link."""
    links = [wheel.end_frame for wheel in wheels]
    axles = np.array([_axle(tags, wheel) for wheel in wheels])
    vertices = [
        SupportVertex(
            wheel.end_frame,
            robot,
            _first(tags.major_axis, wheel.major_axis),
            tube=_first(tags.minor_axis, wheel.minor_axis),
            axis=axle,
            center=wheel.position,
        )
        for wheel, axle in zip(wheels, axles, strict=True)
    ]
    carriers = [carrier_of(robot, link) for link in links]
    carried = np.array([_carried_axle(robot, tags, *each) for each in zip(carriers, links, axles, strict=True)])
    return {
        TASK_POINTS[BASE]: BasePose(robot, pose, CenterOfMass(robot), is_tracked=tags.base == "center_of_mass"),
        TASK_POINTS[VERTICES]: RollingOffsets(robot, vertices, axles, pose=pose, is_late=tags.is_original),
        TASK_POINTS[CAMBER]: Camber(robot, links, axles),
        TASK_POINTS[CASTER]: Caster(robot, carriers, carried),
    }


def moved_by(robot: Robot, tags: DrivingTags) -> np.ndarray:
    """Return the DoFs of the chain, shape (m,); an UnknownName if there is no such group."""
    if tags.chain is None:
        return np.arange(robot.size)
    try:
        return np.sort(robot.selectors[tags.chain].indices)
    except UnknownName as error:
        raise error.at(tags.where("chain")) from None


def steered_by(robot: Robot, tags: DrivingTags, wheel: ContactRecord) -> int:
    """Return the DoF that steers a wheel: that of the link that carries it, about an axis that crosses the axle.

    Raises:
        ComponentError: There is no such joint.
    """
    carrier = carrier_of(robot, wheel.end_frame)
    joint = robot.description.links[carrier].parent
    if joint in robot.dofs:
        axle = _carried_axle(robot, tags, carrier, link=wheel.end_frame, axle=_axle(tags, wheel))
        # the joint bends the leg if its axis and the axle are nearly parallel
        if abs(float(axle.dot(robot.description.joints[joint].axis))) < 0.7:
            return robot.dof(joint)
    raise ComponentError(
        f"nothing steers the wheel '{wheel.end_frame}'",
        where=tags.where("IK"),
        expected=f"a joint above it that does, or no {STEERING}",
    )


def _axle(tags: DrivingTags, wheel: ContactRecord) -> np.ndarray:
    axis = tags.reference_axis.get(wheel.end_frame, wheel.reference_axis)
    if axis is None or not any((axis.x, axis.y, axis.z)):
        raise ComponentError(
            f"no axle of the wheel '{wheel.end_frame}'",
            where=tags.where("reference_axis"),
            expected="`reference_axis` of its contact, or here",
        )
    return _unit(axis.x, axis.y, axis.z)


def _carried_axle(robot: Robot, tags: DrivingTags, carrier: str, link: str, axle: np.ndarray) -> np.ndarray:
    """Return the axle of a wheel in the frame of the link that carries it."""
    given = tags.reference_axis.get(carrier)
    if given is not None:
        return _unit(given.x, given.y, given.z)
    kinematics = robot.kinematics
    return kinematics.rotation(carrier).T @ kinematics.rotation(link) @ axle


def _first(value: float | None, other: float | None) -> float:
    return other if value is None else value  # type: ignore[return-value]


def _unit(*axis: float) -> np.ndarray:
    vector = np.array(axis)
    return vector / np.linalg.norm(vector)


def rows_of(levels: Sequence[Sequence[str]], ends: Sequence[int]) -> dict[str, slice]:
    """Return the rows of each task in the stack, of levels with one task each.

    Args:
        levels: Names of the tasks.
        ends: Where the rows of the levels end, from 0 on.
    """
    return {names[0]: slice(*rows) for names, rows in zip(levels, zip(ends, ends[1:], strict=False), strict=True)}

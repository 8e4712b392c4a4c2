"""The wheels of a robot as an odometry sees them: contacts, their arms from the base, and how joints move them."""

import math
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from solfer.components.odometry import filter_kernel
from solfer.errors import ComponentError
from solfer.points import Handler, make_contact
from solfer.points.contact.contacts import BallContact, PointContact, RollingContact
from solfer.robot import Robot


class _Ground:
    """The plane on which wheels roll.

    Args:
        contacts: Their contacts.

    Attributes:
        normal: Its normal, shape (3,); live.
        is_level: Whether that is vertical.
    """

    def __init__(self, contacts: list[RollingContact]):
        self._contacts = contacts
        self.normal = np.array((0.0, 0.0, 1.0))
        self.is_level = True

    def set_normal(self, x: float, y: float, z: float) -> None:
        """Set the normal, any length."""
        length = math.sqrt(x * x + y * y + z * z)
        self.normal[:] = x / length, y / length, z / length
        was_level = self.is_level
        self.is_level = bool(self.normal[2] >= 1.0 - 1e-9)
        if self.is_level and not was_level:
            self._tilt(self.normal)

    def rotate(self, cosine: float, sine: float) -> None:
        """Let the contacts have the normal, turned about the vertical."""
        x, y, z = self.normal.tolist()
        self._tilt((cosine * x - sine * y, sine * x + cosine * y, z))

    def _tilt(self, normal: ArrayLike) -> None:
        for contact in self._contacts:
            contact.set_normal(normal)


class Wheels:
    """Contacts of the wheels or feet of a group.

    They are its own: the ground's normal may change here, unseen by others.

    A foot is a contact of the type `contact_point`: with an offset a ball that rolls on the ground with its link, else
    a point of a sole. Where a group has wheels, they count alone: what else may touch are hands.

    Args:
        robot: The Robot.
        group: SRDF group of the wheels' links.
        radius: Radius of all wheels [m]; None: that of their contacts.
        where: Place of the group in the configuration, for errors.

    Attributes:
        names: Names of the contacts.
        links: Names of the wheels' links.
        radii: Their radii [m].
        arms: From the base's origin to the contacts, shape (k, 3) [m]; live. These axes and those of the others are
            the world's, turned about the vertical as the base is.
        jacobian: From velocities of the joints to those of the wheels' material there, shape (3k, joints); live.
        ground: The ground: its `normal`, shape (3,), live, and whether it `is_level`.
        legs: Which of them do not roll, shape (joints,).

    Raises:
        ComponentError: The Robot has no floating base, or no wheel.
    """

    def __init__(self, robot: Robot, group: str, radius: float | None, where: str):
        if robot.kinematics.base is None:
            raise ComponentError(f"the base of '{robot.name}' is fixed", where=where, expected="a floating base")
        links = set(robot.links(group))
        touching = [each for each in robot.contact_records if each.end_frame in links]
        records = [each for each in touching if each.type == "wheel"]
        if radius is not None:
            records = [each.model_copy(update={"minor_axis": radius - (each.major_axis or 0.0)}) for each in records]
        elif not records:
            records = touching
        made = [make_contact(each, robot) for each in records]
        self._shared = [robot.contacts[each.name] for each in records]
        self.names = tuple(each.name for each in records)
        if radius is not None and not made:
            # a group of wheels without contacts: their radius is all that is needed, and forces are not known
            self.names = tuple(
                link for link in robot.links(group) if len(robot.kinematics.attachment(link).columns) > 6
            )
            made = [RollingContact(link, robot, 0.0, tube=radius) for link in self.names]
        if not made:
            raise ComponentError(
                f"'{robot.name}' has {len(made)} wheels or feet in '{group}' that touch the ground",
                where=where,
                expected="at least one, and a robot configuration with `contacts: {read: true}`",
            )
        self._robot = robot
        self._contacts = Handler(made)
        self.links = tuple(contact.link for contact in self._contacts)
        radii = tuple((each.minor_axis or 0.0) + (each.major_axis or 0.0) for each in records)
        self.radii = radii or (radius or 0.0,) * len(made)
        count = len(self.names)
        joints = robot.size - 6
        self.arms = np.zeros((count, 3))
        self.jacobian = np.zeros((3 * count, joints))
        self.legs = np.ones(joints, dtype=bool)
        rolling = [each.link for each in made if not _is_foot(each)]
        self.legs[[robot.kinematics.attachment(link).columns[-1] - 6 for link in rolling]] = False
        self._origin = np.zeros(3)
        # the Handler is this object's own: its arrays stay where they are
        measured = self._contacts.value.reshape(-1, 3), self._origin, self._contacts.jacobian
        self._turn_back = partial(filter_kernel.turn_back, *measured, self.arms, self.jacobian)
        self.ground = _Ground([each for each in made if isinstance(each, RollingContact)])
        self._forces = np.zeros(count)
        self.position = robot.state.position[6:]
        self.velocity = robot.state.velocity[6:]

    def __len__(self) -> int:
        return len(self.names)

    def set_normal(self, x: float, y: float, z: float) -> None:
        """Set the normal of the ground, any length."""
        self.ground.set_normal(x, y, z)

    @property
    def steps(self) -> bool:
        """Whether some of them are feet, which lift and land."""
        return any(map(_is_foot, self._contacts))

    @property
    def carrying(self) -> np.ndarray:
        """Which joints lie between base and wheels, shape (joints,); a new array."""
        carrying = np.zeros(self.joints, dtype=bool)
        for link in self.links:
            carrying[[column - 6 for column in self._robot.kinematics.attachment(link).columns if column >= 6]] = True
        return carrying & self.legs

    @property
    def joints(self) -> int:
        """Number of DoFs without the base."""
        return len(self.legs)

    @property
    def weight(self) -> float:
        """Weight of the robot [N]."""
        return 9.81 * self._robot.kinematics.mass

    @property
    def torque(self) -> np.ndarray:
        """Measured torques of the joints, shape (joints,) [Nm]; live."""
        return self._robot.state.torque[6:]

    def update(self, heading: float) -> None:
        """Compute arms and Jacobian at the State, whose base has a heading [rad]; its kinematics are up to date."""
        cosine = math.cos(heading)
        sine = math.sin(heading)
        if not self.ground.is_level:
            self.ground.rotate(cosine, sine)
        self._contacts.update()
        kinematics = self._robot.kinematics
        np.copyto(self._origin, kinematics.position(kinematics.base_link or ""))
        self._turn_back(cosine, sine)

    @property
    def forces(self) -> np.ndarray:
        """Forces of the ground on the wheels along its normal, as they are known, shape (k,) [N]; live."""
        for index, contact in enumerate(self._shared):
            self._forces[index] = contact.force @ self.ground.normal
        return self._forces


def _is_foot(contact: PointContact | RollingContact) -> bool:
    return isinstance(contact, BallContact | PointContact)

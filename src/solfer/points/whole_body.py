"""Points of the whole robot: centre of mass, angular momentum, centre of pressure, posture."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import PointError
from solfer.model.view import RobotView
from solfer.numerics.pointers import address
from solfer.points.compiled import centers, momentum, posture
from solfer.points.compiled.instruction import PRESSING
from solfer.points.contact.contacts import Contact
from solfer.points.contact.support_vertex import UP
from solfer.points.handler import Handler
from solfer.points.offset import chosen, direction
from solfer.points.point import Layout, common_robot
from solfer.points.program import CompiledPoint, Instruction, folded
from solfer.points.space import vector

__all__ = ["AngularMomentum", "CenterOfMass", "CenterOfPressure", "Posture"]


class CenterOfMass(CompiledPoint):
    """Centre of mass of all links that a DoF moves, in the world [m].

    Args:
        robot: The Robot.
    """

    def __init__(self, robot: RobotView):
        super().__init__(3, robot)

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        parents = self.robot.kinematics.tree.parents
        numbers = self.robot.kinematics.tree.inertial
        row = Instruction(centers.center_of_mass, self, numbers=numbers, table=parents)
        return folded(self, np.arange(self.cols), row)


class AngularMomentum(CompiledPoint):
    """Angular momentum of all links that a DoF moves about their centre of mass, world axes [kg m^2/s].

    It is linear in the velocities, and the Jacobian is its matrix: the angular rows of the centroidal momentum matrix.
    A task on it has the momentum itself as its rate: with gain 0 and the feed-forward velocity h it requests the
    momentum h. Source: D. E. Orin, A. Goswami, S.-H. Lee, "Centroidal dynamics of a humanoid robot", Autonomous
    Robots 35, 2013.

    Args:
        robot: The Robot.
    """

    def __init__(self, robot: RobotView):
        super().__init__(3, robot)

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        parents = self.robot.kinematics.tree.parents
        numbers = self.robot.kinematics.tree.inertial
        row = Instruction(momentum.angular_momentum, self, numbers=numbers, table=parents)
        return folded(self, np.arange(self.cols), row)


class Posture(CompiledPoint):
    """Positions of joints [rad, m], as the Robot's state holds them.

    Args:
        robot: The Robot.
        dofs: The DoFs, as names or numbers, such as `robot.selectors["left_arm"].indices`; default: all.

    Attributes:
        dofs: Their indices, in the order of the value, shape (size,).

    Raises:
        UnknownName: The robot has no such DoF.
        PointError: There is no DoF, one is there twice, or a number is none of a DoF.
    """

    def __init__(self, robot: RobotView, dofs: Sequence[str | int] | None = None):
        names = robot.kinematics.dofs
        self.dofs = chosen("DoF", dofs, len(names), names=names, where=f"posture of '{robot.name}'", error=PointError)
        super().__init__(len(self.dofs), robot)
        followers = robot.kinematics.tree.followers
        self._leaders = np.unique(followers.leaders[np.isin(followers.dofs, self.dofs)])

    def written_columns(self) -> np.ndarray:
        """Return the DoFs, and those that they follow, in the order of the Robot, shape (m,)."""
        return np.union1d(self.dofs, self._leaders)

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        numbers = self.robot.state.position
        row = Instruction(posture.posture, self, numbers=numbers, table=self.dofs, columns=self._leaders)
        return folded(self, self.dofs, row)


class CenterOfPressure(CompiledPoint):
    """Centre of pressure of contacts, in the plane through the world's origin across the normal [m].

    It is the mean of the contacts' positions, weighted with their normal forces; contacts that are lifted or pull do
    not count. The moment of a contact that constrains one, such as a flat foot, moves it, too. The Jacobian is the
    true one for constant forces. Without a pressing contact, the value stays and the Jacobian is zero. `update` updates
    no contact: they are updated before it.

    Args:
        contacts: PointContacts and RollingContacts of one Robot. In a Handler they may come and go.
        normal: Normal of the ground in the world, any length, shape (3,).

    Raises:
        PointError: There is no contact, or they are of different Robots.
        SizeMismatch, NotFinite: The normal is not a direction.
    """

    def __init__(self, contacts: Iterable[Contact], normal: ArrayLike = UP):
        self._contacts = contacts if isinstance(contacts, Handler) else tuple(contacts)
        super().__init__(vector(3), common_robot(*self.contacts))
        self._normal = direction(normal, "normal of the centre of pressure")

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts; a PointError if there is none."""
        contacts = tuple(self._contacts)
        wrong = [contact for contact in contacts if not isinstance(contact, Contact)]
        if wrong or not contacts:
            raise PointError(
                f"a centre of pressure of {wrong[0] if wrong else 'no contact'}",
                expected="PointContacts or RollingContacts",
            )
        return contacts

    @property
    def parts(self) -> tuple[Contact, ...]:
        """Return the contacts."""
        return self.contacts

    @property
    def layouts(self) -> tuple[Layout, ...]:
        """See `Point.layouts`; contacts of a Handler come and go."""
        return (self._layout, *([self._contacts.contents] if isinstance(self._contacts, Handler) else []))

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        self._flags[0] = 1  # the columns of a removed contact are not written any more
        arrays = [(contact.value, contact.jacobian, contact.wrench, contact.flags) for contact in self.contacts]
        rows = [
            (*map(address, of_contact), contact.constraint[:, 3:].any())
            for of_contact, contact in zip(arrays, self.contacts, strict=True)
        ]
        table = np.array(rows, dtype=PRESSING)
        instruction = Instruction(centers.center_of_pressure, self, numbers=self._normal, table=table)
        instruction.arrays += arrays
        return (instruction,)

    def written_columns(self) -> np.ndarray:
        """Return the DoFs that move a contact, shape (m,)."""
        return np.unique(np.concatenate([contact.columns for contact in self.contacts]))

"""The centre of pressure as a point."""

from collections.abc import Iterable, Sequence

import numpy as np

from solfer.errors import PointError
from solfer.points.compiled import layout
from solfer.points.contacts import Contact
from solfer.points.handler import Handler
from solfer.points.offset import direction
from solfer.points.point import common_robot
from solfer.points.program import CompiledPoint, Instruction, address
from solfer.points.space import vector
from solfer.points.vertex import UP


class CenterOfPressure(CompiledPoint):
    """Centre of pressure of contacts, in the plane through the world's origin across the normal [m].

    It is the mean of the contacts' positions, weighted with their normal forces; contacts that are lifted or pull do
    not count. The Jacobian is the true one for forces that stay as they are. Where nothing presses, the value stays and
    the Jacobian is zero. `update` updates no contact: they are updated before it.

    Args:
        contacts: PointContacts and RollingContacts of one Robot. In a Handler they may come and go.
        normal: Normal of the ground in the world, any length, shape (3,).

    Raises:
        PointError: There is no contact, or they are of different Robots.
        SizeMismatch, NotFinite: The normal is no direction.
    """

    def __init__(self, contacts: Iterable[Contact], normal: Sequence[float] = UP):
        self._contacts = contacts if isinstance(contacts, Handler) else tuple(contacts)
        super().__init__(vector(3), common_robot(*self.contacts))
        self._normal = direction(normal, "normal of the centre of pressure")

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contacts; a PointError if there is none."""
        contacts = tuple(self._contacts)
        wrong = [contact for contact in contacts if not isinstance(contact, Contact)]
        if wrong or not contacts:
            raise PointError(f"a centre of pressure of {wrong[0] if wrong else 'no contact'}",
                             expected="PointContacts or RollingContacts")
        return contacts

    @property
    def parts(self) -> tuple[Contact, ...]:
        """The contacts."""
        return self.contacts

    def instructions(self) -> tuple[Instruction, ...]:
        """What the kernel has to do for this point alone."""
        self._flags[0] = 1  # the columns of a contact that has gone are not written any more
        arrays = [(contact.value, contact.jacobian, contact.wrench, contact.flags) for contact in self.contacts]
        table = np.array([[address(array) for array in contact] for contact in arrays], dtype=np.int64)
        instruction = Instruction(layout.PRESSURE, self, numbers=self._normal, table=table, count=len(table))
        instruction.arrays += arrays
        return (instruction,)

    def written_columns(self) -> np.ndarray:
        """DoFs that move a contact, shape (m,)."""
        return np.unique(np.concatenate([contact.columns for contact in self.contacts]))

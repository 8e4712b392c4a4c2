"""Keeps what a failing component does to a Robot away from others that share it."""

from typing import TYPE_CHECKING

import numpy as np

from solfer.errors import NotFinite
from solfer.model.state import DEFAULTS
from solfer.robot import Robot

if TYPE_CHECKING:
    from solfer.robot.contacts import Contacts


class MeasuredGuard:
    """Remembers the measured State and the wrenches of the contacts before a component works, to put them back.

    Args:
        owner: Name of the plugin, for messages.
        robot: Its Robot.
    """

    def __init__(self, owner: str, robot: Robot):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import finite

        self._owner, self._dofs, self._contacts, self._finite = owner, robot.dofs, self._contacts_of(robot), finite
        self._values = robot.state.defaults
        self._kept = np.zeros_like(self._values)
        # to copy as bytes takes a quarter of the time
        self._source, self._target = _octets(self._values), _octets(self._kept)
        self._flat = self._values.reshape(-1)
        self._wrenches = self._wrenches_kept = np.zeros((0, 6))

    def keep(self) -> None:
        """Remember what is measured now."""
        self._target[:] = self._source
        if self._contacts is not None:
            wrenches = self._contacts.wrenches
            if wrenches is not self._wrenches:  # contacts have come or gone
                self._wrenches, self._wrenches_kept = wrenches, np.zeros_like(wrenches)
            self._wrenches_kept[...] = wrenches

    def restore(self) -> None:
        """Put back what was remembered."""
        self._source[:] = self._target
        if self._contacts is not None and len(self._contacts.wrenches) == len(self._wrenches):
            self._contacts.wrenches[...] = self._wrenches_kept

    def check(self) -> None:
        """Check what the component has left.

        Raises:
            NotFinite: A number that it has written is NaN or infinite; names it.
        """
        if not self._finite(self._flat):
            interface, dof = np.argwhere(~np.isfinite(self._values))[0]
            raise self._error(f"a '{DEFAULTS[interface]}' of '{self._dofs[dof]}'")
        if self._contacts is None:
            return
        wrenches = self._contacts.wrenches
        if not self._finite(wrenches.reshape(-1)):
            contact = self._contacts.names[np.argwhere(~np.isfinite(wrenches))[0][0]]
            raise self._error(f"a wrench of contact '{contact}'")

    def _error(self, what: str) -> NotFinite:
        return NotFinite(f"'{self._owner}' writes {what} that is not finite", expected="a number in every cycle")

    @staticmethod
    def _contacts_of(robot: Robot) -> "Contacts | None":
        return robot.contacts if robot.contact_records else None


def _octets(array: np.ndarray) -> memoryview:
    return memoryview(array).cast("B")

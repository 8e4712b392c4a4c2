"""Keeps what a failing component does to a Robot away from others that share it."""

import numpy as np

from solfer.errors import NotFinite
from solfer.model.state import DEFAULTS
from solfer.robot import Robot


class MeasuredGuard:
    """Remembers the measured State and the wrenches of the contacts before a component works, to put them back.

    Args:
        owner: Name of the plugin, for messages.
        robot: Its Robot.
    """

    def __init__(self, owner: str, robot: Robot):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import tables_finite

        self._owner = owner
        self._dofs = robot.dofs
        self._finite = tables_finite
        self._contacts = robot.contacts if robot.contact_records else None
        self._values = robot.state.defaults
        self._wrenches = np.zeros((0, 6))
        self._kept, self._wrenches_kept = _Kept(self._values), _Kept(self._wrenches)

    def keep(self) -> None:
        """Remember what is measured now."""
        kept = self._kept
        kept.target[:] = kept.source
        if self._contacts is not None:
            wrenches = self._contacts.wrenches
            if wrenches is not self._wrenches:  # contacts have come or gone
                self._wrenches, self._wrenches_kept = wrenches, _Kept(wrenches)
            kept = self._wrenches_kept
            kept.target[:] = kept.source

    def restore(self) -> None:
        """Put back what was remembered."""
        for kept in (self._kept, self._wrenches_kept):
            kept.source[:] = kept.target
        if self._contacts is not None and len(self._contacts.wrenches) == len(self._wrenches):
            self._contacts.wrenches[...] = self._wrenches

    def check(self) -> None:
        """Check what the component has left.

        Raises:
            NotFinite: A number that it has written is NaN or infinite; names it.
        """
        contacts = self._contacts
        if self._finite(self._values, self._wrenches if contacts is None else contacts.wrenches):
            return
        wrong = np.argwhere(~np.isfinite(self._values))
        if len(wrong):
            raise self._error(f"a '{DEFAULTS[wrong[0][0]]}' of '{self._dofs[wrong[0][1]]}'")
        if contacts is not None:
            contact = contacts.names[np.argwhere(~np.isfinite(contacts.wrenches))[0][0]]
            raise self._error(f"a wrench of contact '{contact}'")

    def _error(self, what: str) -> NotFinite:
        return NotFinite(f"'{self._owner}' writes {what} that is not finite", expected="a number in every cycle")


class _Kept:
    """An array and a copy of it, both as bytes: to copy those takes a quarter of the time.

    Attributes:
        source: The array's bytes.
        target: Those of the copy.
    """

    def __init__(self, array: np.ndarray):
        self.source, self.target = (_octets(each) for each in (array, np.zeros_like(array)))


def _octets(array: np.ndarray) -> memoryview:
    return memoryview(array).cast("B") if array.size else memoryview(bytearray())

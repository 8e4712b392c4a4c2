"""Keeps what a failing component does to a Robot away from others that share it."""

import numpy as np

from solfer.components import Component
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

    def run(self, component: Component) -> None:
        """Run one cycle of a component; if it fails, what was measured before is put back.

        Raises:
            NotFinite: A number that it has written is NaN or infinite; names it.
        """
        kept = self._kept
        kept.target[:] = kept.source
        if self._contacts is not None:
            wrenches = self._contacts.wrenches
            if wrenches is not self._wrenches:  # contacts have come or gone
                self._wrenches, self._wrenches_kept = wrenches, _Kept(wrenches)
            kept = self._wrenches_kept
            kept.target[:] = kept.source
        try:
            component.update()
            component.send()
            contacts = self._contacts
            if not self._finite(self._values, self._wrenches if contacts is None else contacts.wrenches):
                raise self._find()
        except BaseException:
            self._restore()
            raise

    def _restore(self) -> None:
        """Put back what was remembered."""
        for kept in (self._kept, self._wrenches_kept):
            kept.source[:] = kept.target
        if self._contacts is not None and len(self._contacts.wrenches) == len(self._wrenches):
            self._contacts.wrenches[...] = self._wrenches

    def _find(self) -> NotFinite:
        """Return an error that names a number that is not finite."""
        wrong = np.argwhere(~np.isfinite(self._values))
        if len(wrong):
            what = f"a '{DEFAULTS[wrong[0][0]]}' of '{self._dofs[wrong[0][1]]}'"
        else:
            contact = self._contacts.names[np.argwhere(~np.isfinite(self._contacts.wrenches))[0][0]]
            what = f"a wrench of contact '{contact}'"
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

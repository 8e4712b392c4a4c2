"""Numbers of one interface of a State on their way in: whole or in part, filtered or not."""

import numpy as np

from solfer.model import State
from solfer.numerics.filters import LowPass
from solfer.numerics.selection import selection

INTERFACES = {"position": "position", "velocity": "velocity", "effort": "torque"}
"""Field of a pipe, and the State's interface that it belongs to."""


class Channel:
    """Numbers that a pipe brings for one interface of a State.

    Args:
        field: One of INTERFACES.
        dofs: DoFs of the State that they belong to, shape (k,).
        low_pass: Filter of the numbers; None: they are taken as they come.

    Attributes:
        field: One of INTERFACES.
        interface: The State's interface.
        values: The newest numbers, shape (k,).
        flags: Room for a check of `values`, shape (k,).
    """

    def __init__(self, field: str, dofs: np.ndarray, low_pass: LowPass | None = None):
        self.field, self.values, self.flags = field, np.zeros(len(dofs)), np.zeros(len(dofs), dtype=bool)
        self.interface, self._dofs, self._all, self._low_pass = INTERFACES[field], dofs, selection(dofs), low_pass
        self._held, self._passed = np.zeros(len(dofs)), np.zeros(len(dofs))

    def write(self, state: State, part: np.ndarray | None) -> None:
        """Write `values` to the State: all, or those at the places `part`."""
        if part is None:
            state.write(self.interface, self.values, self._all)
        else:
            state.write(self.interface, self.values[part], self._dofs[part])

    def accept(self, part: np.ndarray | None) -> None:
        """`values`, or those at the places `part`, are what the filter sees from now on."""
        places = slice(None) if part is None else part
        self._held[places] = self.values[places]

    def filter(self, state: State, part: np.ndarray | None) -> None:
        """One step of the filter; what passes it is written to the State: all, or what is at the places `part`."""
        np.copyto(self._passed, self._held)
        self._low_pass.step(self._passed)
        if part is None:
            state.write(self.interface, self._passed, self._all)
        else:
            state.write(self.interface, self._passed[part], self._dofs[part])

    def reset(self) -> None:
        """The filter begins anew with the next numbers, as if they had been there for ever."""
        if self._low_pass is not None:
            self._low_pass.reset()

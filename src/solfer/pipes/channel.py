"""Numbers of one interface of a State on their way in: whole or in part, filtered or not."""

import numpy as np

from solfer.model import State
from solfer.numerics.filters import LowPass

INTERFACES = {"position": "position", "velocity": "velocity", "effort": "torque"}
"""Field of a pipe, and the State's interface that it belongs to."""


class Channel:
    """Numbers that a pipe brings for one interface of a State.

    Args:
        state: The State that they belong to.
        field: One of INTERFACES.
        dofs: DoFs of the State that they belong to, shape (k,).
        low_pass: Filter of the numbers; None: they are taken as they come.

    Attributes:
        field: One of INTERFACES.
        interface: The State's interface.
        values: The newest numbers, shape (k,).
        changes: How often `write` or `filter` changed the State.
        gather: See `solfer.numerics.gathering`.
    """

    def __init__(self, state: State, field: str, dofs: np.ndarray, low_pass: LowPass | None = None):
        # the compiler behind it takes a while to load
        from solfer.numerics.gathering import gather, scatter

        self.gather, self._scatter = gather, scatter
        self.field, self.values, self.changes = field, np.zeros(len(dofs)), 0
        self.interface, self._dofs, self._low_pass = INTERFACES[field], dofs, low_pass
        self._state, self._live = state, state[self.interface]
        self._held, self._passed = np.zeros(len(dofs)), np.zeros(len(dofs))

    def write(self, values: np.ndarray, part: np.ndarray | None) -> None:
        """Write numbers, such as `values`, to the State: all, or those at the places `part`."""
        if part is not None:
            self.changes += self._state.write(self.interface, values[part], self._dofs[part])
        elif self._scatter(values, self._dofs, self._live):
            self._state.touch(self.interface)
            self.changes += 1

    def accept(self, part: np.ndarray | None) -> None:
        """`values`, or those at the places `part`, are what the filter sees from now on."""
        places = slice(None) if part is None else part
        self._held[places] = self.values[places]

    def filter(self, part: np.ndarray | None) -> None:
        """One step of the filter; what passes it is written to the State: all, or what is at the places `part`."""
        self._passed[...] = self._held
        self._low_pass.step(self._passed)
        self.write(self._passed, part)

    def reset(self) -> None:
        """The filter begins anew with the next numbers, as if they had been there for ever."""
        if self._low_pass is not None:
            self._low_pass.reset()

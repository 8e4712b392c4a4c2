"""Filters and writes received values into one interface of a State."""

import numpy as np

from solfer.model import State
from solfer.numerics.filters import LowPass


def interface_of(field: str) -> str:
    """Return the State's interface of a pipe's field."""
    return "torque" if field == "effort" else field


class StateField:
    """Received values of one interface of a State.

    Args:
        state: The State.
        field: A field of a pipe.
        dofs: DoFs of the values, shape (k,).
        low_pass: Filter of the values; None: they are written as received.

    Attributes:
        field: See above.
        interface: The State's interface.
        values: The newest values, shape (k,).
        changes: How often `write` or `filter` changed the State.
        gather: See `solfer.numerics.kernels`.
    """

    def __init__(self, state: State, field: str, dofs: np.ndarray, low_pass: LowPass | None = None):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import gather, scatter

        self.gather, self._scatter = gather, scatter
        self.field, self.values, self.changes = field, np.zeros(len(dofs)), 0
        self.interface, self._dofs, self._low_pass = interface_of(field), dofs, low_pass
        self._state, self._live = state, state[self.interface]
        self._held, self._passed = np.zeros(len(dofs)), np.zeros(len(dofs))

    def write(self, values: np.ndarray, part: np.ndarray | None) -> None:
        """Write numbers, such as `values`, to the State: all, or those at the indices `part`."""
        if part is not None:
            self.changes += self._state.write(self.interface, values[part], self._dofs[part])
        elif self._scatter(values, self._dofs, self._live):
            self._state.touch(self.interface)
            self.changes += 1

    def accept(self, part: np.ndarray | None) -> None:
        """Pass `values`, or those at the indices `part`, to the filter as its new input."""
        places = slice(None) if part is None else part
        self._held[places] = self.values[places]

    def filter(self, part: np.ndarray | None) -> None:
        """Make one step of the filter, and write its output to the State: all, or that at the indices `part`."""
        self._passed[...] = self._held
        self._low_pass.step(self._passed)
        self.write(self._passed, part)

    def reset(self) -> None:
        """Reset the filter: it starts settled at the next values."""
        if self._low_pass is not None:
            self._low_pass.reset()

"""Received values of one interface of a State."""

import numpy as np

from solfer.numerics.filters import LowPass


def interface_of(field: str) -> str:
    """Return the State's interface of a pipe's field."""
    return "torque" if field == "effort" else field


class StateField:
    """Received values of one interface of a State.

    Args:
        field: A field of a pipe.
        dofs: DoFs of the values, shape (k,).
        values: Where the newest values are decoded to, shape (k,).
        passed: Where the filter's output goes, shape (k,).
        low_pass: Filter of the values; None: they are written as received.

    Attributes:
        field: See above.
        interface: The State's interface.
        dofs: See above.
        values: See above.
    """

    def __init__(
        self, field: str, dofs: np.ndarray, values: np.ndarray, passed: np.ndarray, low_pass: LowPass | None = None
    ):
        self.field, self.interface, self.dofs = field, interface_of(field), dofs
        self.values = values
        self._passed = passed
        self._low_pass = low_pass
        self._held = np.zeros(len(dofs))

    def accept(self, part: np.ndarray | None) -> None:
        """Pass `values`, or those at the indices `part`, to the filter as its new input."""
        places = slice(None) if part is None else part
        self._held[places] = self.values[places]

    def filter(self) -> None:
        """Make one step of the filter."""
        self._passed[...] = self._held
        self._low_pass.step(self._passed)

    def reset(self) -> None:
        """Reset the filter: it starts settled at the next values."""
        if self._low_pass is not None:
            self._low_pass.reset()

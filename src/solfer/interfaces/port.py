"""Robot Points that a component receives or publishes, without knowing how they travel."""

import numpy as np

from solfer.config.kinds.point import QUANTITIES
from solfer.errors import UnknownName


class Port:
    """One Robot Point, or several of one kind; numbers are linear before angular, quaternions (x, y, z, w).

    A component puts a port into its `inputs` or `outputs` when it is made; a pipe of the same name connects it.

    Args:
        quantity: One of QUANTITIES.
        count: Number of Points; None: a single one.
        required: Whether the component cannot work without a pipe that connects the port.

    Attributes:
        value: The numbers, shape (k,), or (count, k) of several Points; an input keeps them until new ones arrive.
        fresh: Whether an input has received new numbers in this cycle.

    Raises:
        UnknownName: There is no such quantity.
    """

    def __init__(self, quantity: str, count: int | None = None, required: bool = False):
        if quantity not in QUANTITIES:
            raise UnknownName("quantity", quantity, QUANTITIES)
        self.quantity = quantity
        self.count = count
        self.required = required
        self.value = np.zeros(QUANTITIES[quantity] if count is None else (count, QUANTITIES[quantity]))
        if quantity in ("orientation", "pose"):
            self.value[..., -1] = 1.0
        self.fresh = False

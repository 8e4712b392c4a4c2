"""Sums and differences of Dynamic Points: of their values, Jacobians and offsets."""

from typing import ClassVar

import numpy as np

from solfer.points.algebra import Minus, Plus
from solfer.points.compiled import layout
from solfer.points.dynamic import CompiledDynamicPoint, offset_of, require_same_x
from solfer.points.point import Operand
from solfer.points.program import Instruction


class _DynamicPair(CompiledDynamicPoint):
    """Two DynamicPoints with the same x, or one and a constant."""

    operation: ClassVar[int]

    def __init__(self, first: Operand, second: Operand):
        super().__init__(first, second)
        self._dynamic = require_same_x(self.first, self.second)

    @property
    def x(self) -> np.ndarray:
        """x of what it is made of, shape (cols,); live."""
        return self._dynamic.x

    def instructions(self) -> tuple[Instruction, ...]:
        """What the kernel has to do for this point alone."""
        offsets = offset_of(self.first), offset_of(self.second)
        return (*super().instructions(), Instruction(self.operation, self._offset, offsets))


class DynamicPlus(_DynamicPair, Plus):
    """Sum of two DynamicPoints, or of one and a constant; x is theirs. Otherwise as `Plus`, which makes it.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: Robots differ, or what their Jacobians are multiplied with.
    """

    operation = layout.PLUS


class DynamicMinus(_DynamicPair, Minus):
    """First DynamicPoint minus the second one; one of the two may be a constant. x is theirs. Otherwise as `Minus`,
    which makes it.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: Robots differ, or what their Jacobians are multiplied with.
    """

    operation = layout.MINUS


DYNAMIC = {Plus: DynamicPlus, Minus: DynamicMinus}
"""What takes the place of a sum or difference that has a DynamicPoint."""

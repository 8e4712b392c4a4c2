"""Sums and differences of Dynamic Points: of their values, Jacobians and offsets."""

from typing import Any, ClassVar

import numpy as np

from solfer.points.algebra import Minus, Plus
from solfer.points.compiled import layout
from solfer.points.dynamic import CompiledDynamicPoint, offset_of, require_same_x
from solfer.points.point import Operand, Point
from solfer.points.program import Instruction


class _DynamicPair(CompiledDynamicPoint):
    """Two DynamicPoints with the same x, or one and a constant."""

    operation: ClassVar[int]
    first: Point
    second: Point

    def __init__(self, first: Operand, second: Operand):
        super().__init__(first, second)  # type: ignore[arg-type]  # that of Plus or Minus, the next class
        self._dynamic = require_same_x(self.first, self.second)

    @property
    def x(self) -> np.ndarray:
        """The operands' x, shape (cols,); live."""
        return self._dynamic.x

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        offsets = offset_of(self.first), offset_of(self.second)
        own = super().instructions()  # type: ignore[safe-super]  # that of Plus or Minus, the next class
        return (*own, Instruction(self.operation, self._offset, offsets))


class DynamicPlus(_DynamicPair, Plus):
    """Sum of two DynamicPoints, or of one and a constant; x is theirs. Otherwise as `Plus`, which makes it.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: The operands differ in their Robot or their x.
    """

    operation = layout.PLUS


class DynamicMinus(_DynamicPair, Minus):
    """First DynamicPoint minus the second one; one of the two may be a constant, and x is theirs.

    Otherwise as `Minus`, which makes it.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: The operands differ in their Robot or their x.
    """

    operation = layout.MINUS


DYNAMIC: dict[type, type[Any]] = {Plus: DynamicPlus, Minus: DynamicMinus}
"""Replacements of sums and differences that have a DynamicPoint."""

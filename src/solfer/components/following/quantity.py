"""What a reference has of the seven numbers of a pose."""

from dataclasses import dataclass

import numpy as np

from solfer.config.kinds.point import QUANTITIES
from solfer.errors import NotFinite, SizeMismatch
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.reference_filter import FURTHEST_TARGET
from solfer.numerics.rotations import is_unit, quaternion_product
from solfer.points import Constant
from solfer.points.space import ORIENTATION, POSE


@dataclass(frozen=True)
class PoseNumbers:
    """The numbers of a pose that a reference has.

    Attributes:
        quantity: 'position', 'orientation' or 'pose'.
        first: The first one, 0 or 3.
        size: How many.
        place: Where differences and rates have the position.
        turn: Where they have the turn.
    """

    quantity: str
    first: int
    size: int
    place: slice
    turn: slice

    @classmethod
    def of(cls, reference: Constant) -> "PoseNumbers":
        """Return those of a reference."""
        quantity = quantity_of(reference)
        is_turn = quantity == "orientation"
        empty = slice(0, 0)
        return cls(
            quantity,
            3 if is_turn else 0,
            QUANTITIES[quantity],
            place=empty if is_turn else slice(3),
            turn=empty if quantity == "position" else slice(-3, None),
        )

    @property
    def all(self) -> slice:
        """Where they are in a pose."""
        return slice(self.first, self.first + self.size)

    def check(self, values: tuple[float, ...] | np.ndarray, where: str) -> None:
        """Check a reference.

        Args:
            values: Position [m], quaternion, or both.
            where: Whose it is, for errors.

        Raises:
            SizeMismatch: There are not as many numbers.
            NotFinite: One is NaN, infinite or far beyond any place, or a quaternion has not the length 1.
        """
        if len(values) != self.size:
            raise SizeMismatch(
                f"{len(values)} numbers", where=where, expected=f"the {self.size} of its {self.quantity}"
            )
        numbers = np.array(values, dtype=float)
        if not np.isfinite(numbers).all():
            raise NotFinite(f"a reference of {numbers.tolist()}", where=where)
        if np.any(abs(numbers[self.place]) > FURTHEST_TARGET):
            raise NotFinite(
                f"a reference at {numbers[self.place].tolist()} m",
                where=where,
                expected=f"coordinates of up to {FURTHEST_TARGET:g} m",
            )
        if self.quantity != "position" and not is_unit(numbers[-4:].tolist()):
            raise NotFinite(
                f"a reference with the quaternion {numbers[-4:].tolist()}",
                where=where,
                expected="a quaternion of length 1",
            )

    def displace(self, move: PlanarMove, numbers: np.ndarray) -> None:
        """Move a reference in the world with the base."""
        if self.quantity != "orientation":
            move.move(numbers[:3])
        if self.quantity != "position":
            move.rotate_orientation(numbers[-4:])

    def add(self, reference: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """Return a reference and numbers that are added to it; quaternions turn it in the same axes."""
        result = reference + numbers
        if self.quantity != "position":
            result[-4:] = quaternion_product(numbers[-4:], reference[-4:])
        return result


def quantity_of(reference: Constant) -> str:
    """Return the quantity of a reference."""
    if reference.space == ORIENTATION:
        return "orientation"
    return "pose" if reference.space == POSE else "position"

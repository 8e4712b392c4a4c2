"""Converts joint values between a robot's hardware and its model."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import SizeMismatch
from solfer.transport.messages import GAINS

Correction = Callable[[np.ndarray, np.ndarray], None]
"""Writes the corrected first array into the second one; both may be the same."""

same: Correction = np.positive
"""Copies the first array into the second one; a function of numpy, which costs the cycle no call of Python."""


class Calibration:
    """Names, signs and zeros of joints of the hardware, in the order of a pipe.

    For a joint with the sign s and the offset o, the reading of the hardware where the model is at zero:

        position:  q = s (h - o)        h = s q + o
        velocity:  v = s v_h            v_h = s v
        effort:    tau = s tau_h        tau_h = s tau

    Stiffness and damping are the same on both sides, every other interface has the sign.

    Args:
        names: The hardware's names, k of them.
        sign: 1 or -1, shape (k,).
        offset: Offsets, shape (k,) [rad, m].

    Raises:
        SizeMismatch: There is not one sign and one offset for each name.
    """

    def __init__(self, names: Sequence[str], sign: ArrayLike, offset: ArrayLike):
        self.names = tuple(names)
        self.sign = np.array(sign, dtype=float)
        self.offset = np.array(offset, dtype=float)
        for what, values in (("signs", self.sign), ("offsets", self.offset)):
            if values.shape != (len(self.names),):
                raise SizeMismatch(f"{values.size} {what} for {len(self.names)} joints")

    def to_robot(self, field: str) -> Correction:
        """Return the conversion of a message's `field` from hardware to model."""
        sign = self.sign
        offset = self.offset

        def position(values: np.ndarray, out: np.ndarray) -> None:
            np.subtract(values, offset, out=out)
            np.multiply(out, sign, out=out)

        return self._other(field) or position

    def to_hardware(self, field: str) -> Correction:
        """Return the conversion of a message's `field` from model to hardware."""
        sign = self.sign
        offset = self.offset

        def position(values: np.ndarray, out: np.ndarray) -> None:
            np.multiply(values, sign, out=out)
            np.add(out, offset, out=out)

        return self._other(field) or position

    def _other(self, field: str) -> Correction | None:
        """Return the conversion of a field other than the position, the same in both directions."""
        if field == "position":
            return None
        return same if field in GAINS else self._turn

    def _turn(self, values: np.ndarray, out: np.ndarray) -> None:
        np.multiply(values, self.sign, out=out)

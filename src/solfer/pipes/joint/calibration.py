"""Converts joint values between a robot's hardware and its model."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import SizeMismatch
from solfer.transport.messages import GAINS


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

    def signs(self, fields: Sequence[str]) -> np.ndarray:
        """Return the signs of fields of a message, shape (len(fields), k)."""
        return np.array([np.ones_like(self.sign) if field in GAINS else self.sign for field in fields])

    def offsets(self, fields: Sequence[str]) -> np.ndarray:
        """Return the offsets of fields of a message, shape (len(fields), k): a model's number is s (h - o)."""
        return np.array([self.offset if field == "position" else np.zeros_like(self.offset) for field in fields])

    @classmethod
    def none(cls, names: Sequence[str]) -> "Calibration":
        """Return that of hardware which has the model's names, signs and zeros."""
        return cls(names, np.ones(len(names)), np.zeros(len(names)))

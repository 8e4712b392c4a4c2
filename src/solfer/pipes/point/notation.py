"""Conventions in which the orientations of Robot Points travel."""

import numpy as np

from solfer.config.records.conventions import AnglesRecord, ConventionRecord
from solfer.errors import PipeError
from solfer.numerics.rotations import QuaternionConvention, quaternion_from_rotation, rotation_from_angles
from solfer.pipes.body.reading import turns


class PointNotation:
    """Converts Points with an orientation between their notation on the wire and that of a port.

    A port holds Hamilton quaternions (x, y, z, w), behind the position if there is one.

    Args:
        convention: The notation on the wire.
        angles: Order of the turns where the orientation is three angles; None: x, y, z.

    Attributes:
        located: Whether positions are used.
    """

    def __init__(self, convention: ConventionRecord, angles: AnglesRecord | None = None):
        orientation = convention.orientation
        self.located = convention.position.type == "FULL"
        self._convention = QuaternionConvention(orientation.order, orientation.convention)
        self._axes = turns(angles) if orientation.type == "EULER" else None

    def read(self, values: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write received Points in the notation of a port into `out`, shape (k,) or (n, k), and return it.

        Raises:
            PipeError: The numbers have another shape.
        """
        # angles become four numbers
        if self._axes is not None:
            if values.shape != (3,):
                raise PipeError(f"numbers of shape {values.shape}", expected="shape (3,), angles about x, y and z")
            out[...] = quaternion_from_rotation(rotation_from_angles(values.tolist(), self._axes))
            return out
        if values.shape != out.shape:
            raise PipeError(f"numbers of shape {values.shape}", expected=f"shape {out.shape}")
        np.copyto(out, values)
        for row, received in zip(np.atleast_2d(out), np.atleast_2d(values), strict=True):
            self._convention.read(received[-4:], row[-4:])
        return out

    def write(self, values: np.ndarray, out: np.ndarray) -> None:
        """Write a port's Points in the notation of the wire into `out`, shape (k,) or (n, k) each."""
        np.copyto(out, values)
        for row, sent in zip(np.atleast_2d(out), np.atleast_2d(values), strict=True):
            self._convention.write(sent[-4:], row[-4:])
        if not self.located:
            out[..., :3] = 0.0

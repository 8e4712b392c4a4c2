"""References through values with times."""

import math

import numpy as np

from solfer.numerics.via_points import ViaPoints
from solfer.references.generator import ReferenceGenerator, turned_by


class TimedReference(ReferenceGenerator):
    """Cubic polynomials through values with times, at rest at both ends.

    Its rate at a value is the weighted harmonic mean of the mean rates before and after it, and zero where these differ
    in sign: so it overshoots no value (F. N. Fritsch and J. Butland, "A method for constructing local monotone
    piecewise cubic interpolants", SIAM J. Sci. Stat. Comput. 5(2), 1984). Quaternions are interpolated number by
    number, and brought to the length 1.

    Args:
        rates: How many numbers its velocity has.
        times: Of the values, increasing, from above 0 on, shape (k,) [s]. One at 0 is where a relative one begins.
        values: Shape (k, size).
        absolute: Whether the values are those of the reference, not relative to its origin; NaN: that of the origin.
    """

    def __init__(self, rates: int, times: np.ndarray, values: np.ndarray, absolute: bool):
        super().__init__(values.shape[1], rates, float(times[-1]))
        self._turn = self.size - 4 if self.size != rates else self.size
        self._begins = times[0] == 0.0
        self._times = times if self._begins else np.append(0.0, times)
        self._values = values
        self._is_absolute = absolute
        self._number, self._change = np.zeros((2, self.size))
        self._via: ViaPoints
        # speeds of an absolute one are known from its first value on
        known = np.isfinite(values[0]) if absolute else np.zeros(self.size, dtype=bool)
        self.start(np.where(known, values[0], self.origin))

    def start(self, origin: np.ndarray) -> None:
        """See `ReferenceGenerator.start`."""
        super().start(origin)
        values = np.where(np.isnan(self._values), self.origin, self._values)
        turn = self._turn
        if not self._is_absolute:
            first = values[0].copy()
            if self._begins:
                values[:, :turn] -= first[:turn]
                first[turn:-1] *= -1.0
            values[:, :turn] += self.origin[:turn]
            for row in values[:, turn:] if turn < self.size else ():
                if self._begins:
                    row[:] = turned_by(row, first[turn:])
                row[:] = turned_by(row, self.origin[turn:])
        rows = values if self._begins else np.vstack([self.origin, values])
        if turn < self.size:
            for before, row in zip(rows[:-1, turn:], rows[1:, turn:], strict=True):
                row *= math.copysign(1.0, float(before.dot(row)))
        self._via = ViaPoints(self._times, rows, _rates(self._times, rows))

    def at(self, time: float, position: np.ndarray, velocity: np.ndarray) -> None:
        """See `ReferenceGenerator.at`."""
        turn = self._turn
        number = self._number
        change = self._change
        if turn == self.size:
            self._via.at(max(time, 0.0), position, velocity)
            return
        self._via.at(max(time, 0.0), number, change)
        velocity[:turn] = change[:turn]
        # angular velocity 2 q' q*, of which the change of the length is no part
        x = number[turn]
        y = number[turn + 1]
        z = number[turn + 2]
        w = number[turn + 3]
        dx = change[turn]
        dy = change[turn + 1]
        dz = change[turn + 2]
        dw = change[turn + 3]
        square = x * x + y * y + z * z + w * w
        velocity[turn] = 2.0 * (dx * w - dw * x - dy * z + dz * y) / square
        velocity[turn + 1] = 2.0 * (dy * w - dw * y - dz * x + dx * z) / square
        velocity[turn + 2] = 2.0 * (dz * w - dw * z - dx * y + dy * x) / square
        position[:turn] = number[:turn]
        np.multiply(number[turn:], 1.0 / math.sqrt(square), out=position[turn:])

    def sample_times(self) -> np.ndarray:
        """See `ReferenceGenerator.sample_times`."""
        pieces = np.linspace(self._times[:-1], self._times[1:], 8, endpoint=False)
        return np.sort(pieces, axis=None)


def _rates(times: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Compute the rates at all rows, shape (k, n)."""
    steps = np.diff(times)[:, None]
    slopes = np.diff(rows, axis=0) / steps
    rates = np.zeros_like(rows)
    before = slopes[:-1]
    after = slopes[1:]
    first = 2.0 * steps[1:] + steps[:-1]
    second = steps[1:] + 2.0 * steps[:-1]
    same = before * after > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (first + second) / (first / before + second / after)
    rates[1:-1] = np.where(same, mean, 0.0)
    return rates

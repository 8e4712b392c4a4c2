"""The gate in front of the lower level: sends no value that is not finite, clamps values to their limits."""

import logging

import numpy as np

from solfer.errors import NotFinite
from solfer.model import State
from solfer.numerics.kernels import all_finite
from solfer.pipes.joint.pipes import JointCommandPipe
from solfer.pipes.state_field import interface_of
from solfer.throttle import Throttle
from solfer.transport.messages import GAINS, LARGEST_GAIN


class CommandGate:
    """Checks and limits the commands of one pipe to the lower level, in place.

    Order: finite, then position, velocity and effort limits of the Robot, and the bounds of gains.

    Args:
        owner: Name of the plugin, for messages.
        pipe: The pipe.
        lower: The Robot's lower limits.
        upper: The Robot's upper limits.

    Attributes:
        kinds: What it counts: values that were NaN or infinite, and those beyond the limits of each field.
    """

    def __init__(self, owner: str, pipe: JointCommandPipe, lower: State, upper: State):
        self._owner = owner
        self._pipe = pipe
        self.kinds = ("not finite", *(field for field, _ in pipe.fields))
        self._counts = memoryview(bytearray(8 * len(self.kinds))).cast("q")
        self._throttle = Throttle(logging.getLogger(__name__))
        limits = pipe.step.arrays
        for row, (field, _) in enumerate(pipe.fields):
            limits["lower"][row], limits["upper"][row] = _bounds(field, pipe.dofs, lower, upper=upper)
        self._checks = [
            (field, values, *bounds, np.zeros_like(values), np.zeros(len(values), dtype=bool))
            for (field, values), *bounds in zip(pipe.fields, limits["lower"], limits["upper"], strict=True)
        ]

    @property
    def counts(self) -> dict[str, int]:
        """Number of values since the start that were not finite, and for each field that were held at a limit."""
        return dict(zip(self.kinds, self._counts, strict=True))

    def count_in(self, counts: memoryview) -> None:
        """Count on in memory of the caller, an int64 for each of `kinds`."""
        counts[:] = self._counts
        self._counts = counts

    def check(self) -> None:
        """Check and limit what the pipe has collected, where any of it is beyond its bounds.

        Raises:
            NotFinite: A value is NaN or infinite; names the joint, the field and the plugin.
        """
        for field, values, lower, upper, held, flags in self._checks:
            if not all_finite(values, flags):
                self._refuse(field, flags)
            np.maximum(values, lower, out=held)
            np.minimum(held, upper, out=held)
            if held.tobytes() != values.tobytes():
                self._limit(field, values, held, outside=flags)

    def _refuse(self, field: str, finite: np.ndarray) -> None:
        self._counts[0] += int(len(finite) - finite.sum())
        joint = self._pipe.message.names[int(np.argmin(finite))]
        raise NotFinite(
            f"{self._owner} commands a '{field}' of joint '{joint}' that is not a finite number",
            where=f"pipe '{self._pipe.name}'",
        )

    def _limit(self, field: str, values: np.ndarray, held: np.ndarray, outside: np.ndarray) -> None:
        np.not_equal(values, held, out=outside)
        if not outside.any():  # zeros of different signs
            return
        self._counts[self.kinds.index(field)] += int(outside.sum())
        index = int(np.argmax(abs(values - held)))
        # less is no news: a position at the limit that was computed
        if abs(values[index] - held[index]) > 1e-6 * (1.0 + abs(held[index])):
            self._throttle.warning(
                field,
                "%s: '%s' of joint '%s' is held at its limit %.4g instead of %.4g",
                self._owner,
                field,
                self._pipe.message.names[index],
                held[index],
                values[index],
            )
        values[:] = held


def _bounds(field: str, dofs: np.ndarray, lower: State, upper: State) -> tuple[np.ndarray, np.ndarray]:
    if field in GAINS:
        return np.zeros(len(dofs)), np.full(len(dofs), LARGEST_GAIN)
    return lower[interface_of(field)][dofs], upper[interface_of(field)][dofs]

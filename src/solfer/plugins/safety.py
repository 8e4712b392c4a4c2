"""The gate in front of the lower level: what is not finite is never sent, what is beyond a limit is held at it."""

import logging

import numpy as np

from solfer.errors import NotFinite
from solfer.logs import Throttle
from solfer.model import State
from solfer.pipes.joint import INTERFACES, JointController


class Gate:
    """Checks the numbers of one pipe to the lower level, in place.

    Order: finite, then position, velocity and effort limits of the Robot.

    Args:
        owner: Name of the plugin, for messages.
        pipe: The pipe that is guarded.
        lower: The Robot's lower limits.
        upper: The Robot's upper limits.

    Attributes:
        limited: Numbers that were held at a limit, since the start.
    """

    def __init__(self, owner: str, pipe: JointController, lower: State, upper: State):
        self._owner, self._pipe, self.limited = owner, pipe, 0
        self._throttle = Throttle(logging.getLogger(__name__))
        self._checks = [
            (
                field,
                values,
                lower[INTERFACES[field]][pipe.dofs],
                upper[INTERFACES[field]][pipe.dofs],
                np.empty_like(values),
                np.empty(len(values), dtype=bool),
            )
            for field, values in pipe.fields
        ]

    def check(self) -> None:
        """Check what the pipe has collected.

        Raises:
            NotFinite: A NaN or an infinity; names the joint, the field and the plugin.
        """
        for field, values, lower, upper, held, outside in self._checks:
            if not np.isfinite(values, out=outside).all():
                joint = self._pipe.message.names[int(np.argmin(outside))]
                raise NotFinite(
                    f"{self._owner} wants a '{field}' of joint '{joint}' that is not a finite number",
                    where=f"pipe '{self._pipe.name}'",
                )
            np.maximum(values, lower, out=held)
            np.minimum(held, upper, out=held)
            np.not_equal(values, held, out=outside)
            if outside.any():
                self._limit(field, values, held, outside)
                values[:] = held

    def _limit(self, field: str, values: np.ndarray, held: np.ndarray, outside: np.ndarray) -> None:
        self.limited += int(outside.sum())
        index = int(np.argmax(outside))
        self._throttle.warning(
            field,
            "%s: '%s' of joint '%s' is held at its limit %.4g instead of %.4g",
            self._owner,
            field,
            self._pipe.message.names[index],
            held[index],
            values[index],
        )

"""The check that a command passes before anything of it is applied."""

from collections.abc import Sequence

import numpy as np

from solfer.errors import CommandRefused, nearest
from solfer.lower_level.limits import JointLimits
from solfer.pipes.messages import JOINT_FIELDS, JointMessage

TOLERANCE = 1e-9  # [rad, rad/s, Nm]; a value computed to lie on a limit is within it
UNITS = {"position": "rad", "velocity": "rad/s", "effort": "Nm", "stiffness": "Nm/rad", "damping": "Nms/rad"}


class CommandCheck:
    """Checks commands for the joints of one controller.

    Args:
        controller: Name of the controller, for errors.
        limits: Its joints and their limits.
        fields: Fields of a command that the controller understands.
    """

    def __init__(self, controller: str, limits: JointLimits, fields: Sequence[str]):
        self._controller, self._limits, self.fields = controller, limits, tuple(fields)
        self._place = {name: index for index, name in enumerate(limits.joints)}
        self._names: tuple[str, ...] = ()
        self._indices = np.zeros(0, dtype=np.intp)
        free = np.full(len(limits.joints), np.inf)
        self._bounds = {
            "position": (limits.lower, limits.upper),
            "velocity": (-limits.velocity, limits.velocity),
            "effort": (-limits.effort, limits.effort),
            "stiffness": (np.zeros_like(free), free),
            "damping": (np.zeros_like(free), free),
        }

    def check(self, message: JointMessage) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Where the named joints stand in the controller, shape (len(names),), and the fields that were given.

        Raises:
            CommandRefused: The command carries nothing or a field that the controller does not understand; a joint
                is unknown or named twice; an array is not as long as the names, not finite or beyond a limit.
        """
        where = f"controller '{self._controller}'" + (f", command of '{message.sender}'" if message.sender else "")
        indices = self._match(message.names, where)
        given: dict[str, np.ndarray] = {}
        for field in JOINT_FIELDS:
            values = getattr(message, field)
            if values is not None:
                given[field] = self._numbers(field, values, message.names, indices, where)
        if not given:
            raise CommandRefused("the command carries no numbers", where=where,
                                 expected=f"one or more of {', '.join(self.fields)}")
        return indices, given

    def _match(self, names: Sequence[str], where: str) -> np.ndarray:
        names = tuple(names)
        if names == self._names:
            return self._indices
        for name in names:
            if name not in self._place:
                raise CommandRefused(f"unknown joint '{name}'", where=where, names=nearest(name, self._place),
                                     expected=f"joints of this controller: {', '.join(self._place)}")
            if names.count(name) > 1:
                raise CommandRefused(f"joint '{name}' is named {names.count(name)} times", where=where,
                                     expected="every joint once at most")
        self._names, self._indices = names, np.array([self._place[name] for name in names], dtype=np.intp)
        return self._indices

    def _numbers(self, field: str, values: np.ndarray, names: Sequence[str], indices: np.ndarray,
                 where: str) -> np.ndarray:
        """The numbers of one field, checked."""
        if field not in self.fields:
            raise CommandRefused(f"the controller does not take '{field}'", where=where,
                                 expected=f"one or more of {', '.join(self.fields)}")
        try:
            numbers = np.asarray(values, dtype=float)
        except (TypeError, ValueError) as error:
            raise CommandRefused(f"'{field}' is not an array of numbers", where=where) from error
        if numbers.shape != indices.shape:
            raise CommandRefused(f"'{field}' has the shape {numbers.shape} for {len(names)} joints", where=where,
                                 expected=f"{len(names)} numbers, one for each joint")
        lower, upper = self._bounds[field]
        low, high = lower[indices], upper[indices]
        inside = (numbers >= low - TOLERANCE) & (numbers <= high + TOLERANCE) & np.isfinite(numbers)
        if not inside.all():
            wrong = int(np.argmin(inside))
            self._refuse(field, names[wrong], float(numbers[wrong]), float(low[wrong]), float(high[wrong]), where)
        return numbers

    def _refuse(self, field: str, joint: str, value: float, low: float, high: float, where: str) -> None:
        what = f"{field} {value:g} of joint '{joint}'"
        if not np.isfinite(value):
            raise CommandRefused(f"{what} is not a finite number", where=where)
        raise CommandRefused(f"{what} is beyond its limit", where=where,
                             expected=f"from {low:g} to {high:g} [{UNITS[field]}]")

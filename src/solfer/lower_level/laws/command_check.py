"""The check that a command passes before anything of it is applied."""

from collections.abc import Sequence

import numpy as np

from solfer.errors import CommandRefused, nearest
from solfer.lower_level.laws.limits import JointLimits
from solfer.transport.messages import JOINT_FIELDS, LARGEST_GAIN, JointMessage


class CommandCheck:
    """Checks commands for the joints of one controller.

    Args:
        controller: Name of the controller, for errors.
        limits: Its joints and their limits.
        fields: Fields of a command that the controller understands.
    """

    def __init__(self, controller: str, limits: JointLimits, fields: Sequence[str]):
        self._controller = controller
        self._limits = limits
        self.fields = tuple(fields)
        self._place = {name: index for index, name in enumerate(limits.joints)}
        self._names: tuple[str, ...] = ()
        self._indices = np.zeros(0, dtype=np.intp)
        zero = np.zeros(len(limits.joints))
        # of values without a limit: far beyond every robot, and small enough that no product of two overflows
        largest = 1e6
        self._bounds = {
            "position": (np.maximum(limits.lower, -largest), np.minimum(limits.upper, largest)),
            "velocity": (-np.minimum(limits.velocity, largest), np.minimum(limits.velocity, largest)),
            "effort": (-np.minimum(limits.effort, largest), np.minimum(limits.effort, largest)),
            "stiffness": (zero, zero + LARGEST_GAIN),
            "damping": (zero, zero + LARGEST_GAIN),
        }

    def check(self, message: JointMessage) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Check a command; return the joints' indices in the controller, shape (len(names),), and the given fields.

        Raises:
            CommandRefused: The command carries no field, or one that the controller does not understand; a joint
                is unknown or named twice; an array is not as long as the names, not finite or beyond a limit.
        """
        try:
            if message.interfaces:
                raise CommandRefused(
                    f"the controller does not accept '{message.interfaces[0]}'",
                    expected=f"one or more of {', '.join(self.fields)}",
                )
            indices = self._match(message.names)
            given = {
                field: self._numbers(field, values, message.names, indices=indices)
                for field in JOINT_FIELDS
                if (values := getattr(message, field)) is not None
            }
            if not given or not len(indices):
                raise CommandRefused(
                    "the command carries no numbers", expected=f"one or more of {', '.join(self.fields)}"
                )
        except CommandRefused as error:
            sender = f", command of '{message.claimant}'" if message.sender else ""
            raise error.at(f"controller '{self._controller}'{sender}") from None
        return indices, given

    def _match(self, names: Sequence[str]) -> np.ndarray:
        names = tuple(names)
        if names == self._names:
            return self._indices
        for name in names:
            if name not in self._place:
                raise CommandRefused(
                    f"unknown joint '{name}'",
                    names=nearest(name, self._place),
                    expected=f"joints of this controller: {', '.join(self._place)}",
                )
            if names.count(name) > 1:
                raise CommandRefused(
                    f"joint '{name}' is named {names.count(name)} times", expected="every joint once at most"
                )
        self._names = names
        self._indices = np.array([self._place[name] for name in names], dtype=np.intp)
        return self._indices

    def _numbers(self, field: str, values: np.ndarray, names: Sequence[str], indices: np.ndarray) -> np.ndarray:
        """Check the values of one field, and return them as an array."""
        if field not in self.fields:
            raise CommandRefused(
                f"the controller does not accept '{field}'", expected=f"one or more of {', '.join(self.fields)}"
            )
        try:
            numbers = np.asarray(values, dtype=float)
        except (TypeError, ValueError) as error:
            raise CommandRefused(
                f"'{field}' is not an array of numbers", expected="one number for each joint"
            ) from error
        if numbers.shape != indices.shape:
            raise CommandRefused(
                f"'{field}' has the shape {numbers.shape} for {len(names)} joints",
                expected=f"{len(names)} numbers, one for each joint",
            )
        lower, upper = self._bounds[field]
        low = lower[indices]
        high = upper[indices]
        tolerance = 1e-9  # [rad, rad/s, Nm]: a value computed to lie on a limit is within it
        inside = (numbers >= low - tolerance) & (numbers <= high + tolerance) & np.isfinite(numbers)
        if not inside.all():
            wrong = inside.argmin()
            self._refuse(field, names[wrong], float(numbers[wrong]), low=float(low[wrong]), high=float(high[wrong]))
        return numbers

    def _refuse(self, field: str, joint: str, value: float, low: float, high: float) -> None:
        what = f"{field} {value:g} of joint '{joint}'"
        fault = "is beyond its limit" if np.isfinite(value) else "is not a finite number"
        units = {"position": "rad", "velocity": "rad/s", "effort": "Nm", "stiffness": "Nm/rad", "damping": "Nms/rad"}
        raise CommandRefused(f"{what} {fault}", expected=f"from {low:g} to {high:g} [{units[field]}]")

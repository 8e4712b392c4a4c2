"""Pushes: wrenches from outside that act on links for a while."""

from collections.abc import Sequence

import numpy as np

from solfer.errors import SimulationError, UnknownName
from solfer.simulation.physics import STEP
from solfer.simulation.robot_body.body import Body
from solfer.simulation.state import Moment

Vector = Sequence[float] | np.ndarray


class Pushes:
    """The pushes that act on a body; those on one link add up.

    Args:
        body: The robot.
        now: Where its links are at the beginning of a step.
    """

    def __init__(self, body: Body, now: Moment):
        self._body = body
        self._now = now
        self._acting: list[tuple[str, list[float], list[float], int]] = []

    def add(self, link: str, force: Vector, torque: Vector, duration: float) -> None:
        """Begin to push with the next step.

        Args:
            link: Name of a link of the robot.
            force: Force at the link's origin, in world axes, shape (3,) [N].
            torque: Torque in world axes, shape (3,) [Nm].
            duration: How long it acts [s]; rounded to whole steps, one at least.

        Raises:
            UnknownName: The robot has no such link.
            SimulationError: The link cannot move, a number is beyond its bounds, or too many pushes act already.
        """
        body = self._body
        if link not in body.owner:
            raise UnknownName("link", link, body.owner)
        if not body.floating and body.owner[link] == body.base_link:
            raise SimulationError(f"link '{link}' is fixed to the world", expected="a link that moves")
        for what, numbers, unit in (("force", force, "N"), ("torque", torque, "Nm")):
            if len(numbers) != 3 or not all(abs(number) <= 1e4 for number in numbers):  # true for NaN as well
                shown = ", ".join(f"{number:g}" for number in numbers[:4])
                raise SimulationError(
                    f"the {what} of a push on '{link}' is {shown}",
                    expected=f"three numbers from -10000 to 10000 [{unit}]",
                )
        if not 0.0 < duration <= 60.0:
            raise SimulationError(f"the duration of a push is {duration:g}", expected="above 0, to 60 [s]")
        if len(self._acting) >= 64:
            raise SimulationError("64 pushes act already", expected="a push after they have ended")
        steps = max(1, round(duration / STEP))
        self._acting.append((link, [float(value) for value in force], [float(value) for value in torque], steps))

    def apply(self) -> None:
        """Apply the pushes in the step that begins now."""
        if not self._acting:
            return
        for link, force, torque, _ in self._acting:
            self._body.robot.push(link, force, torque, self._now.position(link).tolist())
        self._acting = [(*push[:3], push[3] - 1) for push in self._acting if push[3] > 1]

    def clear(self) -> None:
        """Forget all pushes."""
        self._acting.clear()

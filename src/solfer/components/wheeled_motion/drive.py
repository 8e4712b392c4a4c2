"""Velocities of the base that others send again and again, such as a joystick or navigation."""

import math
from dataclasses import dataclass, field

from solfer.components.geometry import Vector
from solfer.components.wheeled_motion.references import References
from solfer.errors import NotFinite

PATIENCE = 0.55
"""Time after the last message when the base begins to stop [s]."""


@dataclass(frozen=True)
class Twist:
    """A velocity: linear [m/s] and angular [rad/s]."""

    linear: Vector = field(default_factory=Vector)
    angular: Vector = field(default_factory=Vector)


class Drive:
    """Follows the newest velocity with limited acceleration, and stops where no more come.

    Args:
        acceleration: Largest change of the speed [m/s2].
        turn_acceleration: The same of the rate of the heading [rad/s2].
    """

    def __init__(self, acceleration: float, turn_acceleration: float):
        self._limits = acceleration, turn_acceleration
        self._period = 0.0
        self.start()

    def set_period(self, period: float) -> None:
        """Set the period of the control cycle [s]."""
        self._period = period

    def start(self) -> None:
        """Begin at rest; before the first message it drives nothing."""
        self._wanted, self._velocity = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        self._age = math.inf

    def receive(self, message: Twist) -> None:
        """Take over a velocity, seen from the heading of the base: x, y and the rate of the heading count.

        Raises:
            NotFinite: A number is NaN or infinite.
        """
        wanted = message.linear.x, message.linear.y, message.angular.z
        if not all(map(math.isfinite, wanted)):
            raise NotFinite(f"a velocity of {wanted}", where="cmd_vel", expected="finite numbers")
        self._wanted, self._age = wanted, 0.0

    def update(self, references: References, heading: float) -> None:
        """Write the velocity of this cycle to the references; `heading` is that of the base [rad]."""
        if self._age == math.inf:
            return
        self._age += self._period
        wx, wy, wanted_turn = self._wanted if self._age <= PATIENCE else (0.0, 0.0, 0.0)
        vx, vy, turn = self._velocity
        change, largest = math.hypot(wx - vx, wy - vy), self._limits[0] * self._period
        share = 1.0 if change <= largest else largest / change
        vx, vy = vx + share * (wx - vx), vy + share * (wy - vy)
        largest = self._limits[1] * self._period
        turn += min(max(wanted_turn - turn, -largest), largest)
        self._velocity = vx, vy, turn
        cos, sin = math.cos(heading), math.sin(heading)
        references.velocity[:2] = cos * vx - sin * vy, sin * vx + cos * vy
        references.turn[2] = turn
        if self._age > PATIENCE and self._velocity == (0.0, 0.0, 0.0):
            self.start()

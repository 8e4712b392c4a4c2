"""Velocities of the base that others send again and again, such as a joystick or navigation."""

import math
from dataclasses import dataclass, field

from solfer.components.geometry import Vector
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.targets import PATIENCE, check
from solfer.errors import NotFinite


@dataclass(frozen=True)
class Twist:
    """A velocity: linear [m/s] and angular [rad/s]."""

    linear: Vector = field(default_factory=Vector)
    angular: Vector = field(default_factory=Vector)


@dataclass(frozen=True)
class WheelsState:
    """A `solfer/WheelsState`.

    Attributes:
        x, y, z: Velocity of the base in the world [m/s].
        rz: Rate of its heading [rad/s].
        cs: Camber of the wheels [rad]; empty: not given.
        cm: Caster of the wheels [rad]; empty: not given.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    rz: float = 0.0
    cs: tuple[float, ...] = ()
    cm: tuple[float, ...] = ()


class Drive:
    """Follows the newest velocity with limited speed and acceleration, and stops where no more come.

    Args:
        speed: Largest speed [m/s].
        turn_speed: Largest rate of the heading [rad/s].
        acceleration: Largest change of the speed [m/s2].
        turn_acceleration: The same of the rate of the heading [rad/s2].

    Attributes:
        share: Share of the newest velocity that is not larger than it may be.
    """

    def __init__(self, speed: float, turn_speed: float, acceleration: float, turn_acceleration: float):
        self._speeds, self._limits = (speed, turn_speed), (acceleration, turn_acceleration)
        self._period = 0.0
        self._heading: float | None = None
        self.start()

    def set_period(self, period: float) -> None:
        """Set the period of the control cycle [s]."""
        self._period = period

    def start(self) -> None:
        """Begin at rest; before the first message it drives nothing."""
        self._wanted, self._in_world = (0.0, 0.0, 0.0, 0.0), False
        self._age, self._heading, self.share = math.inf, None, 1.0

    @property
    def is_active(self) -> bool:
        """Whether it drives."""
        return self._age != math.inf

    @property
    def is_abandoned(self) -> bool:
        """Whether it brakes since no velocity comes any more, though the last one was to go on."""
        return PATIENCE < self._age < math.inf and any(self._wanted)

    def receive(self, message: Twist) -> None:
        """Take over a velocity, seen from the heading of the base: x, y and the rate of the heading count.

        Raises:
            NotFinite: A number is NaN or infinite.
        """
        self._want((message.linear.x, message.linear.y, 0.0), message.angular.z, "cmd_vel", False)

    def receive_state(self, message: WheelsState, references: References) -> None:
        """Take over a velocity in the world, and angles of the wheels; nothing changes if a part of it is wrong.

        Raises:
            SizeMismatch: There is not one angle for each wheel.
            NotFinite: A number is NaN or infinite.
        """
        for what, angles in (("cs", message.cs), ("cm", message.cm)):
            check(what, angles, len(references.camber))
        self._want((message.x, message.y, message.z), message.rz, "wheels_state", True)
        if message.cs:
            references.camber[:] = message.cs
        if message.cm:
            references.caster[:] = message.cm

    def _want(self, velocity: tuple[float, float, float], turn: float, where: str, in_world: bool) -> None:
        """Take over a velocity."""
        wanted = *velocity, turn
        if not all(map(math.isfinite, wanted)):
            raise NotFinite(f"a velocity of {wanted}", where=where, expected="finite numbers")
        speed, turn_speed = self._speeds
        self.share = min(1.0, speed / max(math.hypot(*velocity), 1e-12), turn_speed / max(abs(turn), 1e-12))
        self._wanted, self._in_world, self._age = (*velocity, turn), in_world, 0.0

    def update(self, references: References, heading: float, share: float) -> None:
        """Write the velocity of this cycle to the references.

        Args:
            references: What is wanted.
            heading: Of the base [rad].
            share: Share of the newest velocity that counts, no larger than `self.share`.
        """
        if not self.is_active:
            return
        self._age += self._period
        x, y, z = references.velocity.tolist()
        turn = float(references.turn[2])
        # what is seen from the heading turns with it, which is no change
        before = 0.0 if self._in_world else (heading if self._heading is None else self._heading)
        self._heading = heading
        cos, sin = math.cos(before), math.sin(before)
        vx, vy = cos * x + sin * y, cos * y - sin * x
        wx, wy, wz, wanted_turn = (share * each if self._age <= PATIENCE else 0.0 for each in self._wanted)
        change, largest = math.hypot(wx - vx, wy - vy, wz - z), self._limits[0] * self._period
        share = 1.0 if change <= largest else largest / change
        vx, vy, z = vx + share * (wx - vx), vy + share * (wy - vy), z + share * (wz - z)
        largest = self._limits[1] * self._period
        turn += min(max(wanted_turn - turn, -largest), largest)
        cos, sin = (1.0, 0.0) if self._in_world else (math.cos(heading), math.sin(heading))
        references.velocity[:] = cos * vx - sin * vy, sin * vx + cos * vy, z
        references.turn[2] = turn
        if self._age > PATIENCE and math.hypot(vx, vy, z, turn) < 1e-12:
            references.velocity[:], references.turn[2] = 0.0, 0.0
            self.start()

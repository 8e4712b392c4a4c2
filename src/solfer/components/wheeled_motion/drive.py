"""Velocities of the base that others send again and again, such as a joystick or navigation."""

import math
from dataclasses import dataclass

import numpy as np

from solfer.components.wheeled_motion.pace.kernel import AGE, BEFORE, IN_WORLD, follow
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.targets import STREAM_TIMEOUT, check
from solfer.errors import ComponentError, NotFinite
from solfer.interfaces.geometry import Twist
from solfer.numerics.planar_move import PlanarMove


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
        is_active: Whether it drives.
        ratio: Factor that scales the newest velocity to its limits, 1 within them.
        progress: Ratio of that which it has reached, where it began in the middle of a motion, as after a restart: the
            rest of the way would be lost to the sender. Else 1.
    """

    def __init__(self, speed: float, turn_speed: float, acceleration: float, turn_acceleration: float):
        self.limit(speed, turn_speed, acceleration, turn_acceleration=turn_acceleration)
        self._state = np.zeros(7)
        self.start()

    def limit(self, speed: float, turn_speed: float, acceleration: float, turn_acceleration: float) -> None:
        """Set the largest speeds and accelerations, see above."""
        self._speeds = (speed, turn_speed)
        self._limits = (acceleration, turn_acceleration)

    def start(self) -> None:
        """Begin at rest; before the first message it drives nothing."""
        self._state[:], self._state[BEFORE], self.is_active, self.ratio = 0.0, math.nan, False, 1.0
        self.progress = 1.0

    @property
    def is_abandoned(self) -> bool:
        """Whether it brakes since no velocity comes any more, though the last one was to go on."""
        return self.is_active and self._state[AGE] > STREAM_TIMEOUT and bool(self._state[:IN_WORLD].any())

    def displace(self, move: PlanarMove) -> None:
        """Go on as seen from the base, whose estimate has jumped."""
        if self._state[IN_WORLD]:
            move.rotate(self._state[:2])
        self._state[BEFORE] += move.yaw

    def receive(self, message: Twist) -> None:
        """Take over a velocity, seen from the heading of the base: x, y and the rate of the heading count.

        Raises:
            NotFinite: A number is NaN or infinite.
            ComponentError: It is far beyond what the base may do.
        """
        self._take((message.linear.x, message.linear.y, 0.0), message.angular.z, "cmd_vel", in_world=False)

    def receive_state(self, message: WheelsState, references: References) -> None:
        """Take over a velocity in the world, and angles of the wheels; nothing changes if a part of it is wrong.

        Raises:
            SizeMismatch: There is not one angle for each wheel.
            NotFinite: A number is NaN or infinite.
            ComponentError: A velocity is far beyond what the base may do.
        """
        for what, angles in (("cs", message.cs), ("cm", message.cm)):
            check(what, angles, len(references.camber))
        self._take((message.x, message.y, message.z), message.rz, "wheels_state", in_world=True)
        if message.cs:
            references.camber[:] = message.cs
        if message.cm:
            references.caster[:] = message.cm

    def _take(self, velocity: tuple[float, float, float], yaw_rate: float, where: str, in_world: bool) -> None:
        """Take over a velocity."""
        desired = *velocity, yaw_rate
        if not all(map(math.isfinite, desired)):
            raise NotFinite(f"a velocity of {desired}", where=where, expected="finite numbers")
        speed, turn_speed = self._speeds
        ratio = min(1.0, speed / max(math.hypot(*velocity), 1e-12), turn_speed / max(abs(yaw_rate), 1e-12))
        if ratio < 0.01:  # a fault of the sender: the velocity before goes on
            times = 1.0 / max(ratio, 1e-300)  # which may be 0
            raise ComponentError(
                f"a velocity of {desired}, which is {times:.3g} times what the base may do",
                where=where,
                expected=f"{speed:g} m/s and {turn_speed:g} rad/s at most",
            )
        self.ratio = ratio
        self._state[:BEFORE] = *velocity, yaw_rate, in_world, 0.0
        if not self.is_active:
            change, yaw_change = self._limits
            # a first velocity that takes longer than 0.1 s to reach is one in the middle of a motion
            is_late = math.hypot(*velocity) > 0.1 * change or abs(yaw_rate) > 0.1 * yaw_change
            self.progress = 0.0 if is_late else 1.0
        self.is_active = True

    def update(self, references: References, heading: float, ratio: float, passed: float) -> None:
        """Write the velocity of this cycle to the references; called while it is active.

        Args:
            references: The desired motion.
            heading: Of the base [rad].
            ratio: Factor of the newest velocity, no larger than `self.ratio`.
            passed: Time since the cycle before [s].
        """
        change, yaw_change = self._limits
        given = self._state, references.motion, heading, ratio
        if follow(*given, passed, STREAM_TIMEOUT, change * passed, yaw_change * passed):
            self.start()
        elif self.progress < 1.0:
            self._measure_progress(references, ratio)

    def _measure_progress(self, references: References, ratio: float) -> None:
        """Compare velocity and yaw rate with those that were sent, times a ratio."""
        x, y, z, yaw_rate = self._state[:IN_WORLD].tolist()
        progress = 1.0
        if speed := ratio * math.hypot(x, y, z):
            progress = math.hypot(*references.velocity.tolist()) / speed
        if rate := ratio * abs(yaw_rate):
            progress = min(progress, abs(references.angular.item(2)) / rate)
        self.progress = 1.0 if progress > 0.99 else progress

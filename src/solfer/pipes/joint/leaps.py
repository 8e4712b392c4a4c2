"""Finds measurements of joints that cannot be true: no joint moves as far or as fast, or otherwise than it measures."""

from typing import NoReturn

import numpy as np

from solfer.errors import Contradiction, Stray
from solfer.robot import Robot


class JointLeaps:
    """Compares each measured joint with the messages before.

    A joint has leapt where it is farther from where it was than twice its largest speed allows for the time between,
    and 0.1 rad or m. It is not as fast as three times its largest speed, and 5 rad/s or m/s. Joints without a largest
    speed are not checked. What persists is accepted as soon as the joint can have moved there.

    Its way in a second contradicts its velocities where they differ by more than 0.08 rad or m, a fifth of the way by
    velocities, and what these leave open between messages; so does its way between two messages 5 ms apart by more than
    0.03 rad or m. Velocities that have always been zero were not measured. Such a joint is refused until both ways
    agree again; or it has moved by its velocities for 0.5 s and is within 0.02 rad or m of where it was accepted last,
    for which a joint without ends may be anywhere; or messages pause, or their numbers are frozen, for 0.1 s: else it
    is not where its encoder measures it, and what starts there would move it.

    Args:
        robot: The Robot, with its limits.
        dofs: DoFs that the pipe measures, shape (k,).

    Attributes:
        address: What `find_leap` gets, which returns a number for `refuse`.
    """

    def __init__(self, robot: Robot, dofs: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.numerics.blocks import MemoryBlock
        from solfer.numerics.checks import joints

        self._names = tuple(robot.dofs[dof] for dof in dofs)
        self._fastest = np.array(robot.upper_limits.velocity[dofs])
        self._before = np.zeros((joints.ROWS, len(dofs)))
        self._block = MemoryBlock(
            joints.LEAPS,
            count=len(dofs),
            before=self._before,
            fastest=self._fastest,
            revolutions=np.array(robot.revolutions[dofs]),
            endless=np.isinf(robot.upper_limits.position[dofs]),
        )
        self.address = self._block.address
        self._place = self._before[joints.PLACE]
        self._arrival = self._before[joints.ARRIVAL]
        self._strayed = self._before[joints.STRAYED]
        self._never = [joints.ARRIVAL, joints.STAMP, joints.LAST_STAMP, joints.SHAKEN_UNTIL]
        self.forget()

    def forget(self) -> None:
        """Accept whatever comes next."""
        self._before.fill(0.0)
        self._before[self._never] = -np.inf

    def refuse(self, wrong: int, position: np.ndarray, velocity: np.ndarray, arrival: float) -> NoReturn:
        """Refuse what `find_leap` has found, in the message that it was given.

        Raises:
            Contradiction: A joint cannot be there, or so fast, or its velocities contradict it.
        """
        count = len(self._names)
        name = self._names[wrong % count]
        fastest = f"{self._fastest[wrong % count]:.3g} rad/s at most"
        if wrong >= 2 * count:
            away = abs(self._strayed[wrong % count])
            raise Stray(
                f"'{name}' moved more than {away:.3g} rad otherwise than by its velocities", expected="one encoder"
            )
        if wrong >= count:
            raise Contradiction(f"'{name}' at {velocity[wrong - count]:.3g} rad/s", expected=fastest)
        leap = position[wrong] - self._place[wrong]
        gap = arrival - self._arrival[wrong]
        raise Contradiction(f"'{name}' leaps by {leap:.3g} rad in {1e3 * gap:.0f} ms", expected=fastest)

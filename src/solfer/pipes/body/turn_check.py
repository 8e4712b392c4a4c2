"""Finds orientations of a link that cannot be true: no robot tilts as fast, or its own sensors contradict them."""

import math

import numpy as np

from solfer.errors import Contradiction

UNMEASURED = np.zeros(3)
"""Specific force of a link without an accelerometer [m/s^2]."""


class TurnCheck:
    """Compares each measured orientation with the message before, and with the turn rates since.

    The tilt leaps where it is more than 0.1 rad and 6 rad/s from the message before, for 0.1 s at most. It counts again
    where it is back, within 0.1 rad, or where the specific force has been vertical within 0.1 rad for 0.5 s since then.
    About the vertical an orientation may jump, as compasses do. Orientation and rates contradict each other where the
    turns of a second by both differ by more than 0.08 rad and 0.3 of their sum, and from then on until the turns since
    agree again, or until messages pause for 0.1 s. They do too while rates of the last 0.1 s cover an angle of
    0.008 rad and twice what the orientation does, as those in degrees of a robot that stands. Rates that are all zero
    were not measured; those above 10 rad/s are spikes where the orientation since the message before differs from them
    by half. The mean specific force of 1.5 s is vertical within 0.1 rad, which is a change of the velocity by 1.5 m/s;
    it does not count where it is not within 1 m/s^2 of gravity, or the link turns at more than 0.5 rad/s, as in a fall.
    A link that others distrust counts again when its tilt has stayed within 0.02 rad for 0.5 s since the last call of
    `distrust`.
    """

    def __init__(self) -> None:
        # imported here: its compiler takes a while to load
        from solfer.numerics.checks import orientations

        self._check = orientations.check_rotation
        self._before = np.zeros(orientations.NUMBERS)
        self._times = self._before[orientations.ARRIVAL : orientations.STAMP + 1]
        self._distrusted = orientations.IS_DISTRUSTED
        self._reason = ""
        self.forget()

    def forget(self) -> None:
        """Accept whatever comes next."""
        self._before[:] = 0.0
        self._times[:] = -math.inf

    @property
    def is_distrusted(self) -> bool:
        """Whether it is refused for a reason that others have found."""
        return bool(self._before[self._distrusted])

    def distrust(self, reason: str) -> None:
        """Refuse the link until it rests, for a reason that others have found."""
        self._before[self._distrusted :] = 0.0
        self._before[self._distrusted] = 1.0
        self._reason = reason

    def check(
        self, values: np.ndarray, has_own_axes: bool, arrival: float, stamp: float, force: np.ndarray = UNMEASURED
    ) -> str:
        """Check a message, and remember it; return what is odd with it though it counts, empty if nothing is.

        Args:
            values: Orientation, position and twist, as in `BodyReading.values`, shape (13,).
            has_own_axes: Whether the twist is in the axes of the link.
            arrival: When it arrived, in the pipe's own clock [s].
            stamp: When it was true, by the sender's clock [s].
            force: Specific force in the axes of the link, shape (3,) [m/s^2].

        Raises:
            Contradiction: The link cannot have turned like this.
        """
        result, angle = self._check(values, has_own_axes, force, arrival, stamp, self._before)
        # see `solfer.numerics.checks.orientations.check_rotation`
        if result == 1:
            raise Contradiction(f"the tilt leaps by {angle:.3g} rad", expected="a sensor that is fixed to its link")
        if result == 2:
            raise Contradiction(
                f"the orientation turns by {angle:.3g} rad, and otherwise by the turn rates",
                expected="one sensor, with axes and signs of REP 103",
            )
        if result == 3:
            raise Contradiction(
                f"the vertical of the orientation is {angle:.3g} rad from the mean of the accelerometer",
                expected="one sensor, with axes and signs of REP 103",
            )
        if result == 4:
            raise Contradiction(f"turn rates of {angle:.3g} rad/s", expected="an orientation that turns as fast")
        if result == 6:
            raise Contradiction(self._reason, expected="an IMU and joints of legs that agree, at rest for 0.5 s")
        if result == 5:
            return f"the accelerometer measures {angle:.3g} m/s^2 on average (expected: 9.81 at rest, in m/s^2)"
        return ""

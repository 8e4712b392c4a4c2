"""How fast a motion goes along its path: no faster than wheels and joints can follow."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from solfer.components.wheeled_motion.pace.kernel import FOLLOWED, GOING, HELD, LAGS, LIMITED, SPEED, VALUE, advance
from solfer.components.wheeled_motion.points import RollingOffsets
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.steering import Steering
from solfer.numerics.blocks import MemoryBlock


class PathPace:
    """The ratio of all desired velocities that goes on, from 0 to 1, and the references that go on with it.

    No velocity is larger than it may be. A wheel that does not point to where it aims leaves its way with the speed
    v |sin d|, with the desired speed v of its vertex and the angle d between both: the pace keeps it below
    4 mm/s. It also falls as long as joints at their bounds leave base or vertices slower than desired. Speeds
    along the path rise with twice the `acceleration`, and fall with four times; where velocities jump to larger ones,
    vertices follow with three times the acceleration.

    References wait for a base that does not follow, such as one whose joints another plugin holds: they slow down from
    a third of `furthest` on, or from 0.15 rad, and rest at twice that.

    Args:
        references: What is desired.
        steering: Where wheels aim, and the desired speeds of their vertices.
        offsets: The vertices.
        error: Errors of the base: its rotation, and its place [m]; live, shape (6,).

    Attributes:
        is_found: Whether motions wait for wheels and joints; else the pace stays what it is in the references.
        advance: Lets references go on for a cycle, at the pace where it counts, and writes the desired vertices. Takes
            whether the pace is found, whether nothing has been commanded yet, whether joints at their bounds hold the
            motion up, the largest pace, and the time for which they go on [s].
    """

    def __init__(self, references: References, steering: Steering, offsets: RollingOffsets, error: np.ndarray):
        self.is_found = True
        self._state = np.zeros(6)
        self._block = MemoryBlock(
            GOING,
            count=len(references.lifted),
            state=self._state,
            steered=steering.steered,
            base=offsets.base,
            numbers=references.numbers,
            motion=references.motion,
            vertices=references.places,
            orientations=references.orientations,
            desired=offsets.reference,
            error=error,
        )
        self.advance = partial(advance, self._block.address)
        self.start()

    def limit(self, speeds: Sequence[float], acceleration: float, furthest: float) -> None:
        """Set what bounds the motion.

        Args:
            speeds: Largest speeds of the base [m/s], its heading [rad/s] and of a vertex [m/s].
            acceleration: Largest change of a vertex' speed by the pace [m/s2].
            furthest: Largest distance of the base from its reference [m].
        """
        record = self._block.record
        record["base_speed"], record["turn_speed"], record["vertex_speed"] = speeds
        record["acceleration"], record["furthest"] = acceleration, furthest

    @property
    def value(self) -> float:
        """The pace."""
        return float(self._state[VALUE])

    @property
    def held(self) -> float:
        """Ratio that joints at their bounds leave."""
        return float(self._state[HELD])

    def waits_for_base(self) -> bool:
        """Return whether the base is so far from its reference that this one waits."""
        return bool(self._state[LAGS] < 1.0)

    def start(self) -> None:
        """Begin without a motion, which could go on in full."""
        self._state[[VALUE, LIMITED, HELD, LAGS, FOLLOWED]] = 1.0
        self._state[SPEED] = 0.0

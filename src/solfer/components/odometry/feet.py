"""Which feet stand, by the forces of the ground on them."""

import numpy as np

from solfer.components.odometry import feet_kernel as kernel
from solfer.numerics.blocks import MemoryBlock


class Feet:
    """Feet that lift and land: which of them stand, and for how long.

    A foot stands while the ground pushes it by more than `touch` or a tenth of the weight. It counts from 0.02 s later
    on: what lands bounces, and slips. Where no pipe brings the forces they are those that explain the torques of the
    joints, as if legs had no mass: sum_i (t + J^T f)_i^2 is the smallest. A leg that swings has some, too, but its foot
    moves, which the filter refuses.

    Args:
        count: Number of feet k.
        motion: What compiled functions get of their motion; its weights are written.
        weight: Weight of the robot [N].

    Attributes:
        forces: Forces of the ground along the vertical, shape (k,) [N]; live.
        coasted: For how long no foot has measured the base [s].
        uneven: For how long a foot has stood elsewhere than on the floor [s].
    """

    def __init__(self, count: int, motion: MemoryBlock, weight: float):
        self._lightest = 0.1 * weight  # more would leave out the beginning and the end of a step
        self.forces, self._stood = np.zeros((2, count))
        self._block = MemoryBlock(
            kernel.FEET, count=count, forces=self.forces, stood=self._stood, factor=np.zeros((3 * count + 1,) * 2)
        )
        self._motion = motion
        self.start()

    def start(self) -> None:
        """Begin with feet that have stood for long."""
        self._stood[:] = kernel.LANDING
        self.coasted = self.uneven = 0.0

    def weigh(self, known: np.ndarray | None, touch: float, period: float) -> None:
        """Weigh the feet that stand by their forces; none may be left.

        Args:
            known: Forces that a pipe brings, shape (k,) [N]; None: those of the torques count.
            touch: Force from which on a foot stands, if that is less than a tenth of the weight [N].
            period: Time since the last measurement [s].
        """
        if known is not None:
            self.forces[:] = known
        kernel.weigh(self._block.address, self._motion.address, known is None, min(touch, self._lightest), period)

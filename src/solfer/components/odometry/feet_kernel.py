"""Compiled step of `Feet`, where arrays are described."""

from pathlib import Path

from solfer.components.odometry import filter_kernel
from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, part
from solfer.numerics.dense import DENSE, backward, cholesky, forward

FEET = BlockLayout(
    "Feet",
    count=int,
    forces=(float, "count"),
    stood=(float, "count"),  # for how long each one has stood [s]
    factor=(float, "3 * count + 1", "3 * count + 1"),
)
"""What `weigh` keeps."""

LANDING = 0.02
"""Time for which a foot that has landed does not count [s]."""

RIDGE = 1e-4
"""Square of a lever so short that torques say nothing of a force [m^2]: that of a straight leg."""

_feet_at = FEET.at
_motion_at = filter_kernel.MOTION.at


@part
def explain_torques(feet, motion):
    """Write the vertical forces that explain the torques t best: (J J^T + ridge) f = -J t."""
    jacobian = motion.jacobian
    factor = feet.factor
    rows = 3 * feet.count
    forces = factor[rows, :rows]
    for i in range(rows):
        forces[i] = 0.0
        for k in range(motion.joint_count):
            forces[i] -= jacobian[i, k] * motion.torques[k]
        for j in range(i + 1):
            total = RIDGE if i == j else 0.0
            for k in range(motion.joint_count):
                total += jacobian[i, k] * jacobian[j, k]
            factor[i, j] = total
    cholesky(factor[:rows, :rows])
    forward(factor, forces)
    backward(factor, forces)
    for i in range(feet.count):
        feet.forces[i] = forces[3 * i + 2]


def _weigh(start, motion_start, is_by_torques, touch, period):
    """Write the weights of the feet; see `Feet.weigh`."""
    feet = _feet_at(start)
    motion = _motion_at(motion_start)
    if is_by_torques:
        explain_torques(feet, motion)
    for i in range(motion.count):
        stands = feet.forces[i] > touch
        feet.stood[i] = feet.stood[i] + period if stands else 0.0
        motion.weights[i] = feet.forces[i] if stands and feet.stood[i] > LANDING else 0.0


weigh = cached("void(int64, int64, boolean, float64, float64)", _weigh, sources=[DENSE, Path(filter_kernel.__file__)])

"""Default gains of robots that bring none."""

import numpy as np

FULL_EFFORT = 0.1  # [rad, m] of deviation that call for the whole effort
RELAXATION = 0.02  # [s], damping over stiffness


def default_gains(effort_limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness [Nm/rad] and damping [Nms/rad] that use the effort limits [Nm]; joints without one get 100 Nm."""
    effort = np.where(np.isfinite(effort_limit), effort_limit, 100.0)
    stiffness = effort / FULL_EFFORT
    return stiffness, RELAXATION * stiffness

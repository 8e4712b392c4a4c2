"""Angles of joints that are after a turn where they were."""

import numpy as np


def whole_turns(displacements: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return the whole turns in some ways, shape (..., n) [rad]: without them, none is longer than half a turn.

    Args:
        displacements: Differences of positions, shape (..., n) [rad, m].
        turns: The turn of each joint [rad]; 0: it has none.
    """
    return np.asarray(turns * np.rint(displacements / np.where(turns > 0.0, turns, 1.0)))

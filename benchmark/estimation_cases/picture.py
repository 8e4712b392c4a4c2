"""Draws paths."""

from pathlib import Path

import matplotlib
import numpy as np
from estimation_cases.figures import from_start

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402


def draw(path: Path, truth: np.ndarray, estimates: dict[str, np.ndarray]) -> None:
    """Draw paths seen from above, and their errors over the way; poses x y z heading, shape (T, 4) [m, rad]."""
    figure, (above, errors) = pyplot.subplots(1, 2, figsize=(11.0, 4.5))
    true = from_start(truth)
    way = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(true[:, :2], axis=0), axis=1))))
    above.plot(true[::20, 0], true[::20, 1], color="black", linewidth=2.5, label="truth")
    for name, poses in estimates.items():
        seen = from_start(poses)
        above.plot(seen[::20, 0], seen[::20, 1], linewidth=1.0, label=name)
        errors.semilogy(way[::20], 1e-4 + np.linalg.norm((seen - true)[:, :3], axis=1)[::20], linewidth=1.0, label=name)
    above.set_aspect("equal", adjustable="datalim")
    above.set(xlabel="x [m]", ylabel="y [m]")
    errors.set(xlabel="way [m]", ylabel="error of the position [m]")
    above.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    pyplot.close(figure)

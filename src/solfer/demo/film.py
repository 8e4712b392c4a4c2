"""A film of the robot as a GIF, drawn from what was measured."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np

from solfer.robot import Robot
from solfer.simulation.rendering.renderer import Renderer
from solfer.simulation.world.records import WorldRecord

FILM_SIZE, FILM_DENSITY = (320, 240), 100.0
"""Width and height [pixel], and pixels of an inch."""

FILM_STEP, PICTURES = 0.7, 7
"""Time from one picture to the next [s], and how many are shown a second."""


def film(
    robot: Robot,
    times: np.ndarray,
    positions: np.ndarray,
    world: WorldRecord,
    path: Path,
    progress: Callable[[int, int], None] = lambda done, count: None,
) -> None:
    """Draw positions of the robot's DoFs, shape (k, n), at `times` [s], shape (k,), into a GIF.

    Args:
        robot: The Robot.
        times: Times of the rows.
        positions: DoFs.
        world: What is around it.
        path: The file.
        progress: Called with the number of pictures that are done, and of all.
    """
    from matplotlib.animation import PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    moments = np.arange(times[0], times[-1], FILM_STEP)
    rows = np.minimum(np.searchsorted(times, moments), len(times) - 1)
    figure = Figure(figsize=(FILM_SIZE[0] / FILM_DENSITY, FILM_SIZE[1] / FILM_DENSITY), dpi=FILM_DENSITY)
    FigureCanvasAgg(figure)
    writer = PillowWriter(fps=PICTURES)
    with (
        closing(Renderer(robot.description, robot.kinematics, *FILM_SIZE, yaw=60.0, world=world)) as renderer,
        writer.saving(figure, path, FILM_DENSITY),
    ):
        for done, row in enumerate(rows, 1):
            figure.clear()
            figure.figimage(renderer.image(positions[row]))
            writer.grab_frame()
            progress(done, len(rows))

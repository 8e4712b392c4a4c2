"""A film of the robot as a GIF, drawn from what was measured."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np

from solfer.robot import Robot
from solfer.simulation.rendering.renderer import Renderer
from solfer.simulation.world.records import WorldRecord

FILM_SIZE = (640, 360)
"""Width and height [pixel]."""

PICTURES = 15
"""Pictures that are shown a second."""

DURATIONS = (70, 70, 60)
"""Time that pictures are shown, in turn [ms]: GIFs count in hundredths of a second."""

SPEED_UP = 5.0
"""Speed of the film, over that of the robot."""

FILM_COLORS = 96
"""Colours of the film, the same in all pictures: what stands still takes no room."""


def film(
    robot: Robot,
    times: np.ndarray,
    positions: np.ndarray,
    world: WorldRecord,
    path: Path,
    *,
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
    from PIL import Image

    moments = np.arange(times[0], times[-1], SPEED_UP / PICTURES)
    rows = np.minimum(np.searchsorted(times, moments), len(times) - 1)
    pictures: list[Image.Image] = []
    with closing(Renderer(robot.description, robot.kinematics, *FILM_SIZE, yaw=60.0, world=world)) as renderer:
        for done, row in enumerate(rows, 1):
            picture = Image.fromarray(renderer.image(positions[row]))
            if not pictures:
                palette = picture.quantize(FILM_COLORS, dither=Image.Dither.NONE)
            pictures.append(picture.quantize(palette=palette, dither=Image.Dither.NONE))
            progress(done, len(rows))
    durations = [DURATIONS[number % len(DURATIONS)] for number in range(len(pictures))]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=durations, loop=0)

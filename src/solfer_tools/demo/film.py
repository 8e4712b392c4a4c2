"""A film of the robot as a GIF, drawn from what was measured."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np

from solfer.robot import Robot
from solfer.simulation.rendering.renderer import Renderer
from solfer.simulation.world.records import WorldRecord


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

    speed_up = 5.0
    frame_rate = 15  # [Hz]
    frame_times = (70, 70, 60)  # [ms]: GIFs count in hundredths of a second
    moments = np.arange(times[0], times[-1], speed_up / frame_rate)
    rows = np.minimum(np.searchsorted(times, moments), len(times) - 1)
    pictures: list[Image.Image] = []
    with closing(Renderer(robot.description, robot.kinematics, 640, 360, yaw=60.0, world=world)) as renderer:
        for done, row in enumerate(rows, 1):
            picture = Image.fromarray(renderer.image(positions[row]))
            if not pictures:
                # one palette for all pictures: what stands still takes no room
                palette = picture.quantize(96, dither=Image.Dither.NONE)
            pictures.append(picture.quantize(palette=palette, dither=Image.Dither.NONE))
            progress(done, len(rows))
    durations = [frame_times[number % len(frame_times)] for number in range(len(pictures))]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=durations, loop=0)

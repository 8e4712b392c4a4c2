"""Presents Fig. 5 once everything has ended: table, pictures, and a film."""

from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solfer.recording.reader import read
from solfer.robot import Robot
from solfer.simulation.rendering.renderer import Renderer
from solfer.simulation.world.world import find_world, read_world
from solfer.transport.middleware import HealthReport
from solfer_tools.demo import driving_report, report
from solfer_tools.demo.centauro import Progress
from solfer_tools.demo.driving_record import DrivingRecorder
from solfer_tools.demo.film import film
from solfer_tools.demo.tracking_page import tracking_page
from solfer_tools.review import saved

MISSED = 3
"""Exit code of a demonstration that ran to its end, with figures that are not what they are to be."""


@dataclass(frozen=True)
class DrivingFindings:
    """What was seen while the robot drove.

    Attributes:
        robot: The Robot.
        legs: That of the legs alone.
        recorder: Topics.
        reports: Health of the nodes at the end.
        taken: How long it took [s].
        waited: Whether the simulation waited for the plugins.
    """

    robot: Robot
    legs: Robot
    recorder: DrivingRecorder
    reports: Mapping[str, HealthReport]
    taken: float
    waited: bool = False


def present(found: DrivingFindings, file: Path, output: Path, films: bool) -> int:
    """Print the table, and draw pictures and, by `films`, a GIF into the folder `output`.

    Returns:
        The exit code: `MISSED` where real time was not held, or a figure is larger than it may be.

    Raises:
        SolferError: The recording cannot be read, or something cannot be written.
    """
    robot = found.robot
    recording = read(file)
    world = read_world(find_world("gate"))
    seen = driving_report.see(robot, found.legs, found.recorder)
    places = driving_report.tracked(found.recorder, seen, recording)
    rows = driving_report.table(robot, found.recorder, seen, places=places, reports=found.reports, waited=found.waited)
    if warning := driving_report.warning(found.reports, seen, found.taken, waited=found.waited):
        print(warning)
    print(report.format_table(rows))
    narrowest = int(np.argmin(seen.vertices[:, 0, 1] - seen.vertices[:, 1, 1]))
    with closing(Renderer(robot.description, robot.kinematics, yaw=60.0, world=world)) as renderer:
        renderer.save(seen.position[narrowest], output / "demo.png")
    pages = [("tracking", tracking_page(seen.time, places))]
    plots = list(saved(pages, output / "demo_plots.png"))
    print(f"pictures: {', '.join(map(str, (output / 'demo.png', *plots)))}")
    if films:
        path = output / "demo.gif"
        progress = Progress()
        film(
            robot,
            seen.time,
            seen.position,
            world=world,
            path=path,
            progress=lambda done, count: progress("draws the film", done, count),
        )
        print(f"film: {path}")
    return MISSED if warning or any(driving_report.EXCESS_MARK in figure for _, figure in rows) else 0

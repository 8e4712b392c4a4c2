"""One drive in the model alone: the robot does what is commanded, to the number; see `drive` for one in PyBullet."""

import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from driving_cases.courses import REST, Part, Profile
from driving_cases.drive import (
    EVERY,
    LONGEST,
    SETTLED,
    columns_of,
    goal_errors,
    heading_of,
    margin,
    seen_from,
    tracking_of,
)
from driving_cases.driven import driven, lowest_points
from driving_cases.follow import Follower, holder
from driving_cases.scenario import ScenarioProfile
from driving_cases.world import NAME, PERIOD, TRUE_BASE, configuration_of, parameters_of

from solfer import Robot
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.pace.kernel import LATERAL_SPEED
from solfer.config import load
from solfer.errors import SolferError
from solfer.simulation import read_bundle
from solfer_tools.scenarios import Scenario

CAUSES = ("speeds", "wheels", "joints", "start", "lift")
"""What slows a course down: speeds that may not be larger; wheels that do not point there yet; joints, and what holds;
the acceleration along the path afterwards; a wheel that is being lifted."""


class ModelRow(NamedTuple):
    """A cycle; fields are those of `drive.Row`."""

    reference: np.ndarray
    truth: np.ndarray
    desired: np.ndarray
    vertices: np.ndarray
    height: float
    margin: float


class Model:
    """A robot that does what is commanded, without lower level and pipes.

    Args:
        folder: Where the configuration is written.
        tags: Tags of the component that differ from the shipped ones, as YAML.
        is_whole: Whether the plugin's Robot is the whole robot, or its lower body.
        robot: File of the robot; None: CENTAURO.

    Attributes:
        driven: The robot's files and wheels.
        component: What drives it.
        rows: What it looked like, every few cycles.
        costs: Time of each cycle [s].
        lost: Time that the course lost by each of CAUSES [s].
    """

    def __init__(self, folder: Path, tags: str = "", is_whole: bool = True, robot: Path | None = None):
        self.driven = driven(robot)
        bundle, parameters = read_bundle(self.driven.bundle), parameters_of(self.driven)
        self._robot = Robot.load(
            parameters["/robot_description" if is_whole else "/robot_lower_body"],
            Path(bundle.srdf.location),
            contacts=Path(bundle.contacts.location),
            others=[Path(bundle.urdf.location)],
            name=bundle.name,
        )
        dofs, values = self._robot.named_state(bundle.start.state)
        self._robot.state.position[dofs] = values
        self._robot.update()
        tags_of = load(configuration_of(folder, self.driven, tags, is_whole, base=TRUE_BASE), NAME).tags
        self.component = WheeledMotion(self._robot, tags_of(WheeledMotion.Tags), NAME)
        self.component.set_rate(1.0 / PERIOD)
        self.component.init()
        self.rows: list[ModelRow] = []
        self.costs: list[float] = []
        self.lost = np.zeros(len(CAUSES))

    def cycle(self) -> None:
        """Run one cycle, and let the robot be where it was commanded to be."""
        self._note()
        begun = time.thread_time()
        self._robot.update()
        self.component.update()
        self.component.send()
        self.costs.append(time.thread_time() - begun)
        state, command, moved = self._robot.state, self._robot.command, self.component.moved
        state.position[moved], state.velocity[moved] = command.position[moved], command.velocity[moved]
        self._robot.update()

    def look(self) -> None:
        """Keep a row."""
        component, kinematics, references = self.component, self._robot.kinematics, self.component.references
        pelvis, heading = kinematics.position(self.driven.base), heading_of(kinematics.rotation(self.driven.base))
        center = self._robot.center_of_mass.value
        tracked = center if component.tags.base == "center_of_mass" else pelvis
        vertices = lowest_points(kinematics, self.driven.wheels)
        self.rows.append(
            ModelRow(
                np.array((*references.position[:2], references.heading)),
                np.array((*tracked[:2], heading)),
                references.vertices[:, :2].copy(),
                seen_from(heading, vertices[:, :2] - pelvis[:2]),
                float(pelvis[2] - references.position[2]),
                margin(center[:2], vertices[~references.lifted, :2]),
            )
        )

    def _note(self) -> None:
        """Add up what slowed the last cycle down."""
        if self.component.references.waits:
            self.lost[CAUSES.index("lift")] += PERIOD
            return
        pace, steering = self.component._pace, self.component._steering
        away = steering.aims - steering.measured + self.component.wheels.offsets.heading
        across = max(LATERAL_SPEED, float(np.abs(steering.speeds * np.sin(away)).max()))
        speeds, wheels = self.component.references.limits, LATERAL_SPEED / across
        free = min(wheels, pace.held)
        slow = "wheels" if wheels <= pace.held else "joints"
        for cause, share in (("speeds", 1.0 - speeds), (slow, speeds * (1.0 - free))):
            self.lost[CAUSES.index(cause)] += PERIOD * share
        self.lost[CAUSES.index("start")] += PERIOD * max(speeds * free - pace.value, 0.0)


def drive_model(name: str, course: Sequence[Part] | Scenario, seed: int, **options: Any) -> dict[str, Any]:
    """Drive along a course or a scenario; return the figures. `options` are those of a `Model`."""
    is_scenario = isinstance(course, Scenario)
    with tempfile.TemporaryDirectory() as folder:
        model = Model(Path(folder), **options)
    profile = ScenarioProfile(course, PERIOD) if is_scenario else Profile(tuple(course), PERIOD)
    duration = profile.duration
    why, taken = _drive(model, profile, duration)
    costs, last = 1e6 * np.array(model.costs), model.rows[-1]
    figures = {"scenario": name, "seed": seed, **tracking_of(columns_of(model.rows), taken / duration)}
    if is_scenario:
        figures |= goal_errors(model.rows, profile.goal)
    away = max(
        float(np.linalg.norm(last.reference[:2] - last.truth[:2])),
        float(np.linalg.norm(last.desired - last.vertices, axis=1).max()),
    )
    why = why or ("" if away <= SETTLED else f"{away:.3f} m from its references at the end")
    if why:
        print(f"{name}: {why}", file=sys.stderr, flush=True)
    figures |= {
        "done": not why,
        "holds": holder(model.component) if why else "",
        "lost": {cause: round(float(each), 3) for cause, each in zip(CAUSES, model.lost, strict=True)},
        "cycle_p50": float(np.median(costs)),
        "cycle_p99": float(np.percentile(costs, 99)),
    }
    return {key: round(each, 6) if isinstance(each, float) else each for key, each in figures.items()}


def _drive(model: Model, profile: Profile | ScenarioProfile, duration: float) -> tuple[str, float]:
    """Drive until the course is over and the robot rests; return why it failed, and the time taken [s]."""
    follower = Follower(model.component, profile, [wheel.contact for wheel in model.driven.wheels])
    rest, taken = round(REST / PERIOD), 0.0
    for count in range(round((LONGEST * duration + REST) / PERIOD)):
        if not rest:
            return "", taken
        if count % EVERY == 0:
            model.look()
        try:
            follower.step()
        except SolferError as error:
            return str(error), taken
        model.cycle()
        if profile.is_over:
            rest -= 1
        else:
            taken = (count + 1) * PERIOD
    return "" if profile.is_over else "the course is not over", taken

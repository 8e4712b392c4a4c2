"""One drive along a course, and its figures."""

import math
import sys
import tempfile
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from driving_cases.courses import REST, Part, Profile
from driving_cases.follow import Follower, holder
from driving_cases.scenario import Goal, ScenarioProfile
from driving_cases.world import PERIOD, World

from solfer.errors import SolferError
from solfer_tools.scenarios import Scenario

EVERY = 4
"""Cycles from one look at the robot to the next."""

LAGS = np.arange(0.0, 2.0, EVERY * PERIOD)
"""Lags that are tried [s]."""

ARM = 0.5
"""Length by which a turn counts as a way, where a lag is sought [m/rad]."""

SETTLED = 0.02
"""Largest distance of base and vertices from their references at the end of a drive that is done [m]."""

LONGEST = 3.0
"""Duration at which a drive that has not come to its end is given up, as a share of the course's own."""


START = 200
"""Cycles from the start of the plugin to that of the course."""


class Row(NamedTuple):
    """A cycle; places are in the world, vertices are seen from the base's heading.

    Attributes:
        reference: Desired x, y of what is tracked, and heading, shape (3,).
        truth: The same as it is; with an estimated base as it is seen from there, so that a drift does not count.
        desired: Desired vertices, x and y, shape (4, 2) [m].
        vertices: The same as they are.
        height: Height of the base, less the desired one [m].
        up: Direction of the pelvis' z in the world, shape (3,).
        margin: Distance of the centre of mass from the nearest edge of the support polygon [m].
        joint_error: Largest distance of a joint from its command [rad].
        torque: Largest torque of a joint, by its limit.
        power: Sum of the joints' powers, each positive [W].
        sliding: Speeds of the wheels' material and centres, shape (4, 2) [m/s].
        touching: Wheels that touch the ground, shape (4,).
        drift: What the estimate of the base is away from the truth: x, y, and heading, shape (3,) [m, rad].
    """

    reference: np.ndarray
    truth: np.ndarray
    desired: np.ndarray
    vertices: np.ndarray
    height: float
    up: np.ndarray
    margin: float
    joint_error: float
    torque: float
    power: float
    sliding: np.ndarray
    touching: np.ndarray
    drift: np.ndarray


class Recorder:
    """Looks what the robot does beside what is desired.

    Args:
        world: The robot.
    """

    def __init__(self, world: World):
        self._world, robot = world, world.plugin.robot
        rolling = {robot.description.links[wheel].parent for wheel in world.driven.links}
        joints = [name for name in robot.dofs[6:] if name not in rolling]
        self._commanded = np.array([robot.dof(name) for name in joints])
        names = world.simulation.kinematics.dofs
        self._true = np.array([names.index(name) for name in joints])
        self._torque_limit = world.simulation.kinematics.effort_limit[self._true]
        self._moved = np.isin(self._commanded, world.component.moved)
        self._model = world.simulation.kinematics.twin()
        self.weight = 9.81 * world.simulation.kinematics.mass
        self.rows: list[Row] = []

    def look(self) -> None:
        """Keep a row."""
        world, component = self._world, self._world.component
        simulation, references, base = world.simulation, component.references, world.driven.base
        pelvis, heading = simulation.state.now.position(base), heading_of(simulation.state.now.rotation(base))
        self._model.update(simulation.q)
        center = self._model.center_of_mass
        tracked = center if component.tags.base == "center_of_mass" else pelvis
        vertices, truth, drift = world.vertices(), np.array((*tracked[:2], heading)), np.zeros(3)
        if world.is_estimated:
            links = component.model.kinematics
            estimated, estimated_heading = links.position(base), heading_of(links.rotation(base))
            truth[:2] = estimated[:2] + seen_from(-estimated_heading, seen_from(heading, tracked[:2] - pelvis[:2]))
            truth[2], drift[:2], drift[2] = estimated_heading, estimated[:2] - pelvis[:2], estimated_heading - heading
        error = component.model.command.position[self._commanded] - simulation.q[self._true]
        torque = np.abs(simulation.torque[self._true])
        self.rows.append(
            Row(
                np.array((*references.position[:2], references.heading)),
                truth,
                references.vertices[:, :2].copy(),
                seen_from(heading, vertices[:, :2] - pelvis[:2]),
                float(pelvis[2] - references.position[2] - references.rise),
                simulation.state.now.rotation(base)[:, 2].copy(),
                margin(center[:2], vertices[world.touching(), :2]),
                float(np.abs(error[self._moved]).max()),
                float((torque / self._torque_limit)[self._moved].max()),
                float(np.abs(simulation.torque * simulation.v)[6:].sum()),
                world.sliding(),
                world.touching(),
                drift,
            )
        )


def heading_of(rotation: np.ndarray) -> float:
    """Return the heading of a link that is turned by a matrix [rad]."""
    return math.atan2(rotation[1, 0], rotation[0, 0])


def seen_from(heading: float, ways: np.ndarray) -> np.ndarray:
    """Return ways in the world, shape (..., 2), as seen from a heading [rad]."""
    cos, sin = math.cos(heading), math.sin(heading)
    return ways @ np.array(((cos, -sin), (sin, cos)))


def margin(point: np.ndarray, corners: np.ndarray) -> float:
    """Return how far a point is inside a polygon of corners in any order, shape (m, 2) [m]; negative: outside."""
    if len(corners) < 3:
        return -math.inf
    middle = corners.mean(axis=0)
    order = np.argsort(np.arctan2(*(corners - middle).T[::-1]))
    ends, least = corners[order], math.inf
    for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True):
        edge, away = b - a, point - a
        least = min(least, float(edge[0] * away[1] - edge[1] * away[0]) / max(float(np.linalg.norm(edge)), 1e-9))
    return least


def drive(name: str, course: tuple[Part, ...] | Scenario, seed: int, **options: Any) -> dict[str, Any]:
    """Drive along a course or a scenario; return the figures. `options` are those of a `World`."""
    is_scenario = isinstance(course, Scenario)
    with tempfile.TemporaryDirectory() as folder, closing(World(Path(folder), **options)) as world:
        profile = ScenarioProfile(course, PERIOD) if is_scenario else Profile(course, PERIOD)
        duration = profile.duration
        recorder, why, taken = _drive(world, profile, duration)
        figures = {"scenario": name, "seed": seed, **figures_of(recorder, taken / duration)}
        if is_scenario:
            figures |= goal_errors(recorder.rows, profile.goal)
        held = sum(count for key, count in world.plugin.outputs.counts().items() if key)
        costs, holds = 1e6 * np.array(world.costs), holder(world.component)
    errors = recorder.rows[-1]
    away = max(
        float(np.linalg.norm(errors.reference[:2] - errors.truth[:2])),
        float(np.linalg.norm(errors.desired - errors.vertices, axis=1).max()),
        figures.get("goal_base", 0.0),
        figures.get("goal_vertex", 0.0),
    )
    if not why and not away <= SETTLED:
        why = f"{away:.3f} m from its references at the end"
    if why:
        print(f"{name}: {why}", file=sys.stderr, flush=True)
    figures |= {
        "done": not why,
        "why": why,
        "toppled": why.startswith(("tilted", "lies")),
        "holds": holds if why else "",
        "held_back": int(held),
        "cycle_p50": float(np.median(costs)),
        "cycle_p99": float(np.percentile(costs, 99)),
    }
    return {key: round(each, 6) if isinstance(each, float) else each for key, each in figures.items()}


def _drive(world: World, profile: Profile | ScenarioProfile, duration: float) -> tuple[Recorder, str, float]:
    """Drive until the course is over and the robot rests; return what was seen, why it failed, and the time taken."""
    recorder = Recorder(world)
    follower = Follower(world.component, profile, [wheel.contact for wheel in world.driven.wheels])
    cycles, longest = 0, round((LONGEST * duration + REST) / PERIOD)
    rest, taken = round(REST / PERIOD), 0.0

    def follow() -> None:
        """Write what the course desires."""
        nonlocal cycles
        if world.plugin.running and cycles > START:
            if cycles % EVERY == 0:
                recorder.look()
            follower.step()
        cycles += 1

    world.bus.every(PERIOD, follow)
    world.bus.every(PERIOD, world.cycle, cycles=True)
    try:
        while rest and cycles < START + longest:
            world.run(EVERY * PERIOD)
            if why := world.fallen:
                return recorder, why, taken
            if profile.is_over:
                rest = max(rest - EVERY, 0)
            else:
                taken = (cycles - START) * PERIOD
    except SolferError as error:
        return recorder, str(error), taken
    return recorder, "" if profile.is_over else "the course is not over", taken


def columns_of(rows: Sequence[NamedTuple]) -> dict[str, np.ndarray]:
    """Return rows by their fields."""
    return {field: np.array([getattr(row, field) for row in rows]) for field in rows[0]._fields}


def tracking_of(columns: dict[str, np.ndarray], duration: float) -> dict[str, Any]:
    """Compute how well a course was followed, which took a share `duration` of its time."""
    error = columns["truth"] - columns["reference"]
    vertex = np.linalg.norm(columns["vertices"] - columns["desired"], axis=2)
    return {
        "com_rms": _rms(np.linalg.norm(error[:, :2], axis=1)),
        "heading_rms": _rms((error[:, 2] + math.pi) % (2.0 * math.pi) - math.pi),
        "vertex_rms": _rms(vertex),
        "height_rms": _rms(columns["height"] - columns["height"][0]),
        "com_max": float(np.linalg.norm(error[:, :2], axis=1).max()),
        "vertex_max": float(vertex.max()),
        "lag": _lag(columns),
        "duration": duration,
        "margin": float(columns["margin"].min()),
    }


def figures_of(recorder: Recorder, duration: float) -> dict[str, Any]:
    """Compute figures of a drive that took a share `duration` of the time of its course."""
    columns = columns_of(recorder.rows)
    speeds = np.where(columns["touching"][:, :, None], columns["sliding"], 0.0)
    slid, rolled = speeds.sum(axis=0).T * EVERY * PERIOD
    way = float(np.linalg.norm(np.diff(columns["truth"][:, :2], axis=0), axis=1).sum())
    work = float(columns["power"].sum()) * EVERY * PERIOD
    drift = np.linalg.norm((columns["drift"] - columns["drift"][0])[:, :2], axis=1)
    height, tilt = columns["height"] - columns["height"][0], np.arccos(np.clip(columns["up"] @ columns["up"][0], -1, 1))
    return tracking_of(columns, duration) | {
        "height_max": float(np.abs(height).max()),
        "tilt_max": float(tilt.max()),
        "tilt_end": float(tilt[-1]),
        "drift": float(drift.max()),
        "slip": float(slid.sum() / rolled.sum()) if rolled.sum() > 0.05 else None,
        "joint_error": float(columns["joint_error"].max()),
        "torque": float(columns["torque"].max()),
        "cost_of_transport": work / (recorder.weight * way) if way > 0.1 else None,
    }


def goal_errors(rows: list[Row], goal: Goal) -> dict[str, float]:
    """Compute how far base and vertices are from where the scenario has them, by their ways from the first row."""
    first, last = rows[0], rows[-1]
    (x, y, turn), heading = (last.truth - first.truth).tolist(), float(first.truth[2])
    cos, sin = math.cos(heading), math.sin(heading)
    way = np.array((cos * x + sin * y, cos * y - sin * x))
    moved = last.vertices - first.vertices - goal.vertices[:, :2]
    return {
        "goal_base": float(np.linalg.norm(way - goal.base[:2])),
        "goal_heading": abs((turn - float(goal.base[3]) + math.pi) % (2.0 * math.pi) - math.pi),
        "goal_vertex": float(np.linalg.norm(moved, axis=1).max()),
    }


def _rms(values: np.ndarray) -> float:
    return math.sqrt(float(np.mean(values**2)))


def _lag(columns: dict[str, np.ndarray]) -> float | None:
    """Find the lag by which base and vertices follow their references best [s]; None: nothing moves."""
    weights = np.array((1.0, 1.0, ARM))
    motions = []
    for base, vertices in (("reference", "desired"), ("truth", "vertices")):
        places = columns[base] * weights
        places[:, 2] = np.unwrap(columns[base][:, 2]) * ARM
        motions.append(np.hstack((places, columns[vertices].reshape(len(places), -1))))
    desired, found = motions
    if np.ptp(desired, axis=0).max() < 0.01:
        return None
    first = len(LAGS)
    costs = [float(np.sum((found[first:] - desired[first - lag : len(desired) - lag]) ** 2)) for lag in range(first)]
    return float(LAGS[int(np.argmin(costs))])

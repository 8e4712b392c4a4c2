"""Recorded motions of the original program, open loop."""

import gzip
import json
import math
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from driving_cases.golden_shaping import play_shaping
from driving_cases.original import Desired, OriginalLaw
from points import ROOT, URDF

from solfer import Robot
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.references import References
from solfer.config import load

CONFIG, SRDF, CONTACTS = ROOT / "config/centauro.yaml", URDF.with_suffix(".srdf"), URDF.with_name("contacts.yaml")
CLOSE = 1e-6
"""Largest difference of a joint that counts as the same motion [rad]."""


class Golden:
    """A recorded motion.

    Args:
        path: The file.
        content: What is in it.
    """

    def __init__(self, path: Path, content: dict[str, Any]):
        self.content = content
        self.rows = np.array(self.content["rows"], dtype=float)
        self.period, self.cycles = float(self.content["dt"]), int(self.content["cycles"])
        self.every = int(self.content["record_every"])
        self._columns = {name: index for index, name in enumerate(self.content["columns"])}
        self.is_centred = "variant P" not in self.content["scenario"]
        self.has_contacts = not self.content["contact_jacobians"].startswith("never")
        self._vertices = self._vertex_velocities()
        self._base = self._base_velocities()
        self._messages = self._read_messages(path)

    def column(self, *names: str) -> np.ndarray:
        """Return columns of all rows, shape (rows, names)."""
        return self.rows[:, [self._columns[name] for name in names]]

    def positions(self) -> np.ndarray:
        """Return the commanded positions of the rows, shape (rows, m) [rad, m]."""
        return self.column(*(name for name in self._columns if name.startswith("q.")))

    def apply(self, references: References | Desired, cycle: int) -> None:
        """Write the references of a cycle."""
        if self._messages is not None:
            message = self._messages[min(round(cycle * self.period * 1e4) // 100, len(self._messages) - 1)]
            references.vertex_velocity[:] = message[:12].reshape(4, 3)
            references.velocity[:], references.angular[2] = message[12:15], message[15]
            references.camber[:] = message[16:20]
            return
        row = self.rows[min(cycle // self.every, len(self.rows) - 1)]
        velocity = self._base[cycle]
        references.velocity[:] = velocity.real, velocity.imag, row[self._columns["ref_vz"]]
        references.angular[2] = row[self._columns["ref_wz"]]
        references.vertex_velocity[:] = self._vertices[cycle].reshape(4, 3)

    def _read_messages(self, path: Path) -> np.ndarray | None:
        """Read the complete references, if there is a file of them."""
        stem = path.name.removesuffix(".gz").removesuffix(".json")
        for file in path.parent.glob("ref_*.txt.gz"):
            if stem.endswith(file.name.removeprefix("ref_").removesuffix(".txt.gz")):
                return np.loadtxt(file)
        return None

    def _base_velocities(self) -> np.ndarray:
        """Find the velocity of the base's reference in each cycle, x + i y in the world, shape (cycles,) [m/s].

        It turns at a constant rate between rows from which on, or up to which, it does so for two rows at least.
        """
        rows = self.column("ref_vx", "ref_vy") @ (1.0, 1j)
        speeds, steps = np.abs(rows), np.angle(rows[1:] * rows[:-1].conj())
        same = np.isclose(steps[1:], steps[:-1], rtol=0.0, atol=1e-7)
        turns = np.isclose(speeds[1:], speeds[:-1], rtol=0.0, atol=1e-9)
        turns &= np.append(same, False) | np.append(False, same)
        steps = np.append(np.where(turns, steps, 0.0), 0.0)
        cycles = np.arange(self.cycles)
        row = np.minimum(cycles // self.every, len(rows) - 1)
        return rows[row] * np.exp(1j * steps[row] * (cycles % self.every) / self.every)

    def _vertex_velocities(self) -> np.ndarray:
        """Find the velocities of the vertices' references in each cycle, shape (cycles, 12) [m/s].

        Between two rows they change once at most.
        """
        places = self.column(*(f"ref_spv{wheel}_{axis}" for wheel in (1, 2, 3, 4) for axis in "xyz"))
        speeds = np.round(np.diff(places, axis=0) / (self.every * self.period), 7)
        # a row has the references of its cycle, which have moved on already
        whole = np.vstack((speeds[:1], np.repeat(np.vstack((speeds, speeds[-1:])), self.every, axis=0)))[: self.cycles]
        for row in range(1, len(speeds) - 1):
            for column in np.flatnonzero((speeds[row - 1] != speeds[row]) & (speeds[row] != speeds[row + 1])):
                before, after = speeds[row - 1, column], speeds[row + 1, column]
                share = (speeds[row, column] - after) / (before - after)
                start = row * self.every + 1
                change = start + round(share * self.every)
                whole[start:change, column], whole[change : start + self.every, column] = before, after
        return whole


def read(path: Path) -> dict[str, Any]:
    """Read a file of a recorded motion."""
    opened = gzip.open(path, "rt") if path.suffix == ".gz" else path.open()
    with opened as stream:
        content: dict[str, Any] = json.load(stream)
    return content


def is_shaping(content: dict[str, Any]) -> bool:
    """Whether a recorded motion is one of support shaping."""
    return str(content.get("plugin", "")).startswith("NwheelsZMPII")


class Result(NamedTuple):
    """How a motion compares."""

    file: str
    joint_rms: float
    joint_max: float
    until: float
    positions: np.ndarray


def play(path: Path) -> Result:
    """Run a recorded motion."""
    content, robot = read(path), Robot.load(URDF, SRDF, contacts=CONTACTS)
    tags = load(CONFIG, "wheeled_motion").tags(WheeledMotion.Tags)
    if is_shaping(content):
        positions, recorded = play_shaping(content, robot, tags)
        differences = np.abs(positions - recorded)
        far = np.flatnonzero(differences.max(1) > CLOSE)
        times = [row[content["columns"].index("t")] for row in content["rows"]]
        until = times[far[0]] if len(far) else times[-1]
        return Result(path.name, math.sqrt(float(np.mean(differences**2))), float(differences.max()), until, positions)
    golden = Golden(path, content)
    component = start(golden, robot, tags)
    state, command, found = robot.state, robot.command, []
    for cycle in range(golden.cycles):
        robot.update()
        golden.apply(component.references, cycle)
        component.update()
        component.send()
        if cycle % golden.every == 0:
            found.append(command.position[: golden.positions().shape[1]].copy())
        state.position[:30], state.velocity[:30] = command.position[:30], command.velocity[:30]
    positions = np.array(found)
    differences = np.abs(positions - golden.positions()[: len(positions)])
    far = np.flatnonzero(differences.max(1) > CLOSE)
    until = golden.period * (golden.every * far[0] if len(far) else golden.cycles)
    rms = math.sqrt(float(np.mean(differences**2)))
    return Result(path.name, rms, float(differences.max()), until, positions)


def start(golden: Golden, robot: Robot, tags: Any) -> WheeledMotion:
    """Make the component of a recorded motion, at its start."""
    robot.state.position[:] = golden.content["q0"]
    component = WheeledMotion(robot, tags.model_copy(update={"law": "original"}).placed_as(tags), "wheeled_motion")
    component.set_rate(1.0 / golden.period)
    component.init()
    if not golden.is_centred:
        component.references.position[:2] = robot.state.position[:2]
    if not golden.has_contacts:
        for contact in (task.point for task in component.stack.tasks if task.name.startswith("CONSTRAINTS/")):
            contact.active = False
    return component


def law_difference(path: Path) -> float:
    """Return how far the plain law leaves a recorded motion: the largest difference of a joint [rad]."""
    golden, robot = Golden(path, read(path)), Robot.load(URDF, SRDF, contacts=CONTACTS)
    robot.state.position[:] = golden.content["q0"]
    tags = load(CONFIG, "wheeled_motion").tags(WheeledMotion.Tags)
    law = OriginalLaw(robot, tags, golden.period, golden.is_centred, golden.has_contacts)
    recorded, found = golden.positions(), []
    for cycle in range(golden.cycles):
        golden.apply(law.desired, cycle)
        found.append(law.update())
    rows = np.array(found[:: golden.every])[:, : recorded.shape[1]]
    return float(np.abs(rows - recorded[: len(rows)]).max())


def compare(paths: list[Path], is_json: bool, with_law: bool = False) -> bool:
    """Print how recorded motions compare, and `with_law` the plain law; return whether all are close."""
    is_close = True
    for path in paths:
        print(path.name, file=sys.stderr)
        result = play(path)
        is_close &= result.joint_max <= CLOSE
        figures = {name: getattr(result, name) for name in ("file", "joint_rms", "joint_max", "until")}
        line = "{file}: RMS {joint_rms:.1e} rad, largest {joint_max:.1e} rad, close until {until:.2f} s"
        if with_law and not is_shaping(read(path)):
            figures["law_max"] = law_difference(path)
            line += "; the plain law: largest {law_max:.1e} rad"
        print(json.dumps(figures) if is_json else line.format(**figures), flush=True)
    return is_close

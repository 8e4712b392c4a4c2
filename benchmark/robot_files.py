"""What solfer makes of every URDF of example-robot-data and pybullet_data that has a joint that moves.

    python benchmark/robot_files.py [--seed N] [--duration SECONDS] [--json] [NAME...]

For each file: the number of DoFs; whether the robot stands, or holds its joints, in its neutral posture on automatic
gains; how many of 20 targets inverse kinematics (damped least squares on its Jacobians) reaches, which are poses of the
last link in postures drawn within the limits; and where masses, collision shapes or limits of joints are not the same
in the description, in Pinocchio and in PyBullet. A file that cannot be loaded has its reason instead. Robots of
`benchmark/robots.py` have a base that floats or not as there, others as in the URDF. The progress goes to stderr.
"""

import argparse
import json
import logging
import math
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pinocchio as pin
from robots import collections, hold, why

from solfer.errors import MissingDependency, SolferError
from solfer.model.kinematics import Kinematics
from solfer.simulation import Simulation, read_bundle
from solfer.simulation.bullet import differences
from solfer_tools.cli.skeletons.collections import EXAMPLES, PYBULLET, folder_of

TARGETS, NEEDED, STARTS, STEPS = 20, 18, 20, 80
NEAR = 1e-4
"""Largest error of a target that counts as reached [m, rad]."""

DAMPING, LARGEST = 1e-6, 0.3
"""Damping of the least squares, and their largest step of a joint [rad, m]."""


def files() -> dict[str, Path]:
    """List the URDFs that have a joint that moves, by their names in their collection."""
    found = {}
    for collection in (EXAMPLES, PYBULLET):
        try:
            folder = folder_of(collection)
        except MissingDependency:
            continue
        for path in sorted(folder.rglob("*.urdf")):
            text = path.read_text(encoding="utf-8", errors="replace")
            if any(f'type="{kind}"' in text for kind in ("revolute", "continuous", "prismatic")):
                found[f"{collection}:{path.relative_to(folder).with_suffix('').as_posix()}"] = path
    return found


def examine(path: Path, floating: bool | None, duration: float, seed: int) -> dict[str, object]:
    """Load a robot and try what can be done with it; `refused` is why it cannot be loaded."""
    listener = Listener()
    differences.logger.addHandler(listener)
    try:
        simulation = Simulation.from_file(read_bundle(path, floating_base=floating))
    except SolferError as error:
        return {"refused": why(error)}
    finally:
        differences.logger.removeHandler(listener)
    with closing(simulation):
        kinematics = simulation.kinematics
        if not kinematics.description.moving_joints:
            return {"refused": "no joint moves"}
        same = [*listener.messages, *pinocchio_differs(kinematics)]
        reached = reach(kinematics.twin(), np.random.default_rng(seed))
        verdict = hold(simulation, duration)["verdict"]
    return {"dofs": kinematics.size, "differences": same, "verdict": verdict, "reached": reached}


class Listener(logging.Handler):
    """Keeps what a logger says of differences."""

    def __init__(self):
        super().__init__()
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a message without its file."""
        self.messages.append(record.getMessage().partition("differs from it: ")[2])


def pinocchio_differs(kinematics: Kinematics) -> Iterator[str]:
    """Yield by which mass, shapes and limits Pinocchio's own reading of the file differs from the description."""
    description = kinematics.description
    try:
        model = pin.buildModelFromUrdf(description.where)
    except (ValueError, RuntimeError) as error:
        yield f"Pinocchio does not read it: {str(error).strip().splitlines()[0]}"
        return
    mass, other = sum(link.mass or 0.0 for link in description.links.values()), sum(one.mass for one in model.inertias)
    if not math.isclose(other, mass, rel_tol=1e-6, abs_tol=1e-9):
        yield f"mass {mass:g} kg, in Pinocchio {other:g} kg"
    for joint in description.moving_joints:
        if joint.lower is None or joint.mimic is not None or not model.existJointName(joint.name):
            continue
        at = model.joints[model.getJointId(joint.name)].idx_q
        low, high = model.lowerPositionLimit[at], model.upperPositionLimit[at]
        if not np.allclose((joint.lower, joint.upper), (low, high)):
            yield f"joint '{joint.name}': {joint.lower:g} to {joint.upper:g}, in Pinocchio {low:g} to {high:g}"
    count = sum(len(link.collisions) for link in description.links.values())
    folders = [str(folder) for folder in Path(description.where).absolute().parents]
    try:
        shapes = pin.buildGeomFromUrdf(model, description.where, pin.GeometryType.COLLISION, package_dirs=folders)
    except (ValueError, RuntimeError) as error:
        yield f"Pinocchio does not read the shapes: {str(error).strip().splitlines()[0]}"
        return
    if len(shapes.geometryObjects) != count:
        yield f"{count} collision shapes, in Pinocchio {len(shapes.geometryObjects)}"


def reach(kinematics: Kinematics, random: np.random.Generator) -> int:
    """Count the targets that damped least squares reach from other postures; the base stays where it is."""
    description = kinematics.description
    own = [joint.name for joint in description.moving_joints if joint.name not in description.mimics]
    dofs = np.array([kinematics.dofs.index(name) for name in own])
    link = next(joint.child for joint in reversed(description.moving_joints) if joint.name in own)
    return sum(_reached(kinematics, link, dofs, random) for _ in range(TARGETS))


def _reached(kinematics: Kinematics, link: str, dofs: np.ndarray, random: np.random.Generator) -> bool:
    position, lower, upper = np.zeros(kinematics.size), kinematics.lower_position[dofs], kinematics.upper_position[dofs]

    def put(joints: np.ndarray) -> None:
        position[dofs] = joints
        kinematics.followers.follow(position)
        kinematics.update(position)

    def draw() -> np.ndarray:
        low = np.clip(-math.pi, lower, upper)
        return random.uniform(low, np.clip(math.pi, low, upper))

    put(draw())
    place, turn = kinematics.position(link).copy(), kinematics.rotation(link).copy()
    for _ in range(STARTS):
        joints = draw()
        for _ in range(STEPS):
            put(joints)
            error = np.concatenate((place - kinematics.position(link), pin.log3(turn @ kinematics.rotation(link).T)))
            if abs(error).max() < NEAR:
                return True
            jacobian = kinematics.jacobian(link)[:, dofs]
            step = _damped(jacobian, error)
            stuck = ((joints <= lower) & (step < 0.0)) | ((joints >= upper) & (step > 0.0))
            if stuck.any():
                step = _damped(np.where(stuck, 0.0, jacobian), error)
            joints = np.clip(joints + step * min(1.0, LARGEST / max(abs(step).max(), 1e-12)), lower, upper)
    return False


def _damped(jacobian: np.ndarray, error: np.ndarray) -> np.ndarray:
    return jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + DAMPING * np.eye(6), error)


def line(name: str, found: dict[str, object]) -> str:
    """Write a line of the table."""
    if "refused" in found:
        return f"{name:64s}refused: {found['refused']}"
    same = "; ".join(found["differences"])
    low = "" if found["reached"] >= NEEDED else " of 20"
    return f"{name:64s}{found['dofs']:>4d}  {found['verdict']:10s}{found['reached']:>4d}{low}  {same}".rstrip()


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="COLLECTION:FILE without its end (default: all)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the targets (default: %(default)s)")
    parser.add_argument("--duration", type=float, default=1.0, help="simulated time [s] (default: %(default)g)")
    parser.add_argument("--json", action="store_true", help="print JSON, one object a robot")
    options = parser.parse_args()
    logging.getLogger().addHandler(logging.NullHandler())
    robots = files()
    unknown = [name for name in options.names if name not in robots]
    if unknown:
        parser.error(f"no robot '{unknown[0]}'")
    floating = {folder / robot.urdf: robot.floating for folder, robot in collections().values()}
    names = options.names or list(robots)
    for number, name in enumerate(names, start=1):
        print(f"{number}/{len(names)} {name}", file=sys.stderr, flush=True)
        found = examine(robots[name], floating.get(robots[name]), options.duration, options.seed)
        print(json.dumps({"robot": name, **found}) if options.json else line(name, found), flush=True)


if __name__ == "__main__":
    main()

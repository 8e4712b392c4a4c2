"""How well robots that bring nothing but a URDF hold and stand on automatic gains.

    python benchmark/robots.py [--duration SECONDS] [NAME...]

For each robot: the state in which it begins, the largest distance of a joint from its start at the end, the speed of
the fastest joint then, and of a floating base how far it went down and how far it tilts. The robots come with PyBullet
(`pybullet_data`) and, if it is installed, with example-robot-data (`pip install -r requirements-examples.txt`).
"""

import argparse
import importlib.util
import logging
import math
import tempfile
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from solfer.errors import SolferError
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation import Simulation, read_bundle

TILTED = math.radians(20.0)
"""Tilt from which on a robot counts as fallen [rad]."""

MOVING = 0.05
"""Speed of a joint from which on a robot counts as not at rest [rad/s, m/s]."""


@dataclass(frozen=True)
class Robot:
    """Files of a robot below the folder of its collection, and the state of its SRDF in which it begins.

    Without a state the robot begins in its neutral posture. Only the state of the SRDF is used: SRDFs of the
    collections name groups and joints that their URDFs do not have.
    """

    urdf: str
    floating: bool = True
    srdf: str | None = None
    state: str | None = None
    joints: Mapping[str, float] | None = None  # instead of a state [rad]


def example(urdf: str, srdf: str | None = None, state: str | None = None, floating: bool = True) -> Robot:
    """Make a robot of example-robot-data; the SRDF lies in a folder `srdf` of the same robot."""
    package = urdf.split("/")[0]
    return Robot(urdf, floating, srdf and f"{package}/srdf/{srdf}.srdf", state)


PYBULLET = {
    "kuka_iiwa": Robot("kuka_iiwa/model.urdf", False, joints={"lbr_iiwa_joint_2": 0.8, "lbr_iiwa_joint_4": -1.2}),
    "franka_panda": Robot("franka_panda/panda.urdf", floating=False),
    "a1 (no state)": Robot("a1/a1.urdf"),
    "aliengo (no state)": Robot("aliengo/aliengo.urdf"),
    "laikago (no state)": Robot("laikago/laikago_toes_zup.urdf"),
    "r2d2": Robot("r2d2.urdf"),
}
EXAMPLES = {
    "panda": example("panda_description/urdf/panda.urdf", "panda", "default", floating=False),
    "ur5": Robot("ur_description/urdf/ur5_robot.urdf", False, joints={"shoulder_lift_joint": -0.8, "elbow_joint": 1.2}),
    "z1": example("z1_description/urdf/z1.urdf", "z1", "home", floating=False),
    "solo12 (no state)": example("solo_description/robots/solo12.urdf"),
    "solo12": example("solo_description/robots/solo12.urdf", "solo", "standing"),
    "anymal_b": example("anymal_b_simple_description/robots/anymal.urdf", "anymal", "standing"),
    "anymal_c": example("anymal_c_simple_description/urdf/anymal.urdf", "anymal", "standing"),
    "hyq": example("hyq_description/robots/hyq_no_sensors.urdf", "hyq", "standing"),
    "a1": example("a1_description/urdf/a1.urdf", "a1", "standing"),
    "go1": example("go1_description/urdf/go1.urdf", "go1", "standing"),
    "go2": example("go2_description/urdf/go2.urdf", "go2", "standing"),
    "b1": example("b1_description/urdf/b1.urdf", "b1", "standing"),
    "talos": example("talos_data/robots/talos_reduced.urdf", "talos", "half_sitting"),
}
HEADER = ("robot", "start", "DoFs", "sag [rad]", "speed [rad/s]", "sinks [mm]", "tilt [deg]", "")


def collections() -> dict[str, tuple[Path, Robot]]:
    """List all robots that are installed, with the folder of their collection."""
    folder = Path(importlib.util.find_spec("pybullet_data").origin).parent
    found = {name: (folder, robot) for name, robot in PYBULLET.items()}
    try:
        root = Path(distribution("example-robot-data").locate_file("cmeel.prefix/share/example-robot-data/robots"))
    except PackageNotFoundError:
        return found
    return found | {name: (root, robot) for name, robot in EXAMPLES.items()}


def measure(folder: Path, robot: Robot, duration: float) -> tuple[str, ...]:
    """Measure the robot's line of the table, without its name."""
    urdf = folder / robot.urdf
    joints = robot.joints if robot.state is None else _state_of(urdf, folder / robot.srdf, robot.state)
    with tempfile.TemporaryDirectory() as place:
        srdf = None if joints is None else Path(place, "state.srdf")
        if srdf is not None:
            srdf.write_text(_srdf(ElementTree.parse(urdf).getroot().get("name"), joints), encoding="utf-8")
        simulation = Simulation.from_file(read_bundle(urdf, srdf, robot.floating or None))
    with closing(simulation):
        return robot.state or ("-" if joints is None else "joints"), *_hold(simulation, duration)


def _state_of(urdf: Path, srdf: Path, name: str) -> dict[str, float]:
    """Read the positions of a named state, of the joints that the URDF has."""
    known = {joint.get("name") for joint in ElementTree.parse(urdf).iter("joint")}
    joints = ElementTree.parse(srdf).findall(f"group_state[@name='{name}']/joint")
    return {joint.get("name"): float(joint.get("value")) for joint in joints if joint.get("name") in known}


def _srdf(robot: str, joints: Mapping[str, float]) -> str:
    """Write an SRDF with nothing but one state."""
    members = "".join(f'<joint name="{joint}"/>' for joint in joints)
    values = "".join(f'<joint name="{joint}" value="{value}"/>' for joint, value in joints.items())
    return (
        f'<robot name="{robot}"><group name="all">{members}</group>'
        f'<group_state name="start" group="all">{values}</group_state></robot>'
    )


def _hold(simulation: Simulation, duration: float) -> tuple[str, ...]:
    first = 6 if simulation.floating else 0
    start, height = simulation.q[first:].copy(), simulation.body.position[2]
    while simulation.time < duration:
        simulation.step()
    sag = np.abs(simulation.q[first:] - start).max()
    speed = np.abs(simulation.v[first:]).max()
    tilt = math.acos(min(1.0, rotation_from_quaternion(simulation.body.orientation)[2, 2]))
    verdict = "fell" if tilt > TILTED else "moves" if speed > MOVING else "stands" if simulation.floating else "holds"
    base = (f"{1e3 * (height - simulation.body.position[2]):.1f}", f"{math.degrees(tilt):.2f}")
    return (
        str(simulation.kinematics.size),
        f"{sag:.4f}",
        f"{speed:.4f}",
        *(base if simulation.floating else ("-", "-")),
        verdict,
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="robots (default: all that are installed)")
    parser.add_argument("--duration", type=float, default=5.0, help="simulated time [s] (default: %(default)g)")
    options = parser.parse_args()
    logging.disable(logging.WARNING)  # of meshes that are only for the eye
    robots = collections()
    unknown = [name for name in options.names if name not in robots]
    if unknown:
        parser.error(f"no robot '{unknown[0]}'; there are: {', '.join(robots)}")
    row = "{:20s}{:14s}{:>6s}{:>11s}{:>14s}{:>11s}{:>11s}  {}"
    print(row.format(*HEADER))
    for name in options.names or robots:
        try:
            print(row.format(name, *measure(*robots[name], options.duration)), flush=True)
        except SolferError as error:
            print(f"{name:20s}cannot be simulated: {str(error).splitlines()[0]}", flush=True)


if __name__ == "__main__":
    main()

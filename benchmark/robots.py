"""How well robots that bring nothing but a URDF and its SRDF hold and stand on automatic gains.

    python benchmark/robots.py [--duration SECONDS] [NAME...]

For each robot: the state in which it begins, the largest distance of a joint from its start at the end, the speed of
the fastest joint then, and of a floating base how far it went down, how far in the last two seconds, and how far it
tilts. The robots come with PyBullet (`pybullet_data`), which has no SRDFs, and, if it is installed, with
example-robot-data (`pip install -r requirements-examples.txt`): every URDF of it with an SRDF of its own.
"""

import importlib.util
import logging
import math
import tempfile
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from form import Figures, parser_of

from solfer.errors import SolferError, SolferErrors
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation import Simulation, read_bundle

TILTED = math.radians(20.0)
"""Tilt from which on a robot counts as fallen [rad]."""

LAST, SETTLED = 2.0, 0.005
"""How long at the end [s] the height of a standing robot changes by less than this [m]."""

MOVING = 0.05
"""Speed of a joint from which on an arm counts as not at rest [rad/s, m/s]."""

GIVEN_WAY = 0.2
"""Distance from the start from which on a joint of an arm has given way [rad, m]."""


@dataclass(frozen=True)
class Robot:
    """Files of a robot below the folder of its collection. It begins as `read_bundle` says, or with given joints.

    Attributes:
        urdf: The URDF.
        floating: Whether the base floats.
        srdf: The robot's own SRDF.
        joints: Positions of some joints, where there is no SRDF [rad].
    """

    urdf: str
    floating: bool = True
    srdf: str | None = None
    joints: Mapping[str, float] | None = None


def example(urdf: str, srdf: str, floating: bool = True) -> Robot:
    """Make a robot of example-robot-data; the SRDF lies in a folder `srdf` of the same robot."""
    return Robot(f"{urdf}.urdf", floating, f"{urdf.split('/')[0]}/srdf/{srdf}.srdf")


PYBULLET = {
    "kuka_iiwa": Robot("kuka_iiwa/model.urdf", False, joints={"lbr_iiwa_joint_2": 0.8, "lbr_iiwa_joint_4": -1.2}),
    "franka_panda": Robot("franka_panda/panda.urdf", floating=False),
    "xarm6": Robot("xarm/xarm6_robot.urdf", floating=False),
    "a1 (pybullet)": Robot("a1/a1.urdf"),
    "aliengo": Robot("aliengo/aliengo.urdf"),
    "laikago": Robot("laikago/laikago_toes_zup.urdf"),
    "mini_cheetah": Robot("mini_cheetah/mini_cheetah.urdf"),
    "spirit40newer": Robot("quadruped/spirit40newer.urdf"),
    "r2d2": Robot("r2d2.urdf"),
}
EXAMPLES = {
    "a1": example("a1_description/urdf/a1", "a1"),
    "alex_nub_hands": example("alex_description/urdf/alex_nub_hands", "alex_nub_hands"),
    "alex_psyonic_hands": example("alex_description/urdf/alex_psyonic_hands", "alex_psyonic_hands"),
    "alex_sake_hands": example("alex_description/urdf/alex_sake_hands", "alex_sake_hands"),
    "alexander": example("alexander_description/urdf/alexander_v1.lowerBodyOnly", "alexander"),
    "anymal_b": example("anymal_b_simple_description/robots/anymal", "anymal"),
    "anymal-kinova": example("anymal_b_simple_description/robots/anymal-kinova", "anymal-kinova"),
    "anymal_c": example("anymal_c_simple_description/urdf/anymal", "anymal"),
    "b1": example("b1_description/urdf/b1", "b1"),
    "b1-z1": example("b1_description/urdf/b1-z1", "b1-z1"),
    "baxter": example("baxter_description/urdf/baxter", "baxter_manipulation", False),
    "bolt": example("bolt_description/robots/bolt", "bolt"),
    "borinot": example("borinot_description/urdf/borinot_flying_arm_2", "borinot_flying_arm_2"),
    "centauro": example("centauro_description/urdf/centauro", "centauro"),
    "finger_edu": example("finger_edu_description/robots/finger_edu", "finger_edu", False),
    "go1": example("go1_description/urdf/go1", "go1"),
    "go2": example("go2_description/urdf/go2", "go2"),
    "hextilt": example("hextilt_description/urdf/hextilt_flying_arm_5", "hextilt_flying_arm_5"),
    "hyq": example("hyq_description/robots/hyq_no_sensors", "hyq"),
    "icub": example("icub_description/robots/icub", "icub"),
    "icub_reduced": example("icub_description/robots/icub_reduced", "icub"),
    "kinova": example("kinova_description/robots/kinova", "kinova", False),
    "panda": example("panda_description/urdf/panda", "panda", False),
    "pr2": example("pr2_description/urdf/pr2", "pr2"),
    "romeo": example("romeo_description/urdf/romeo", "romeo"),
    "romeo_small": example("romeo_description/urdf/romeo_small", "romeo_small"),
    "simple_humanoid": example("simple_humanoid_description/urdf/simple_humanoid", "simple_humanoid"),
    "simple_humanoid_c": example(
        "simple_humanoid_description/urdf/simple_humanoid_classical", "simple_humanoid_classical"
    ),
    "solo": example("solo_description/robots/solo", "solo"),
    "solo12": example("solo_description/robots/solo12", "solo"),
    "talos_reduced": example("talos_data/robots/talos_reduced", "talos"),
    "talos_full": example("talos_data/robots/talos_full_v2", "talos"),
    "talos_left_arm": example("talos_data/robots/talos_left_arm", "talos", False),
    "ur3_gripper": example("ur_description/urdf/ur3_gripper", "ur3_gripper", False),
    "ur5_gripper": example("ur_description/urdf/ur5_gripper", "ur5_gripper", False),
    "ur5": example("ur_description/urdf/ur5_robot", "ur5", False),
    "ur5_limited": example("ur_description/urdf/ur5_joint_limited_robot", "ur5_joint_limited_robot", False),
    "xarm7": example("xarm_description/urdf/xarm7", "xarm7", False),
    "z1": example("z1_description/urdf/z1", "z1", False),
}


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
    with tempfile.TemporaryDirectory() as place:
        srdf = None if robot.srdf is None else folder / robot.srdf
        if robot.joints is not None:
            srdf = Path(place, "state.srdf")
            srdf.write_text(state_srdf(ElementTree.parse(urdf).getroot().get("name"), robot.joints), encoding="utf-8")
        simulation = Simulation.from_file(read_bundle(urdf, srdf, robot.floating))
    with closing(simulation):
        return {"start": simulation.start, **hold(simulation, duration)}


def state_srdf(robot: str, joints: Mapping[str, float]) -> str:
    """Write an SRDF with nothing but one state."""
    members = "".join(f'<joint name="{joint}"/>' for joint in joints)
    values = "".join(f'<joint name="{joint}" value="{value}"/>' for joint, value in joints.items())
    return (
        f'<robot name="{robot}"><group name="all">{members}</group>'
        f'<group_state name="joints" group="all">{values}</group_state></robot>'
    )


def hold(simulation: Simulation, duration: float) -> dict[str, Any]:
    """Let a robot stand or hold for a while [s]; return its figures, the verdict last."""
    joints = slice(6 if simulation.floating else 0, None)
    start, height, heights = simulation.q[joints].copy(), simulation.body.position[2], []
    while simulation.time < duration:
        simulation.step()
        if simulation.time > duration - LAST:
            heights.append(simulation.body.position[2])
    sag, speed = np.abs(simulation.q[joints] - start).max(), np.abs(simulation.v[joints]).max()
    tilt = math.acos(min(1.0, rotation_from_quaternion(simulation.body.orientation)[2, 2]))
    settled = max(heights) - min(heights)
    base = {"sinks_mm": 1e3 * (height - heights[-1]), "last_mm": 1e3 * settled, "tilt_deg": math.degrees(tilt)}
    if simulation.floating:
        verdict = "falls" if tilt > TILTED else "stands" if settled < SETTLED else "sinks"
    else:
        verdict = "holds" if sag < GIVEN_WAY and speed < MOVING else "gives way"
        base = dict.fromkeys(base)
    return {"dofs": simulation.kinematics.size, "sag": float(sag), "speed": float(speed), **base, "verdict": verdict}


def why(error: SolferError) -> str:
    """Describe in one line why a robot cannot be simulated: the element, without its file, and what is wrong."""
    first = error.errors[0] if isinstance(error, SolferErrors) else error
    element = first.where.rpartition(": ")[2]
    return f"{element}: {first.what}" if "'" in element else first.what


def main() -> None:
    """Print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="robots (default: all that are installed)")
    parser.add_argument("--duration", type=float, default=5.0, help="simulated time [s] (default: %(default)g)")
    options = parser.parse_args()
    logging.disable(logging.WARNING)  # of meshes that are only for the eye
    robots = collections()
    unknown = [name for name in options.names if name not in robots]
    if unknown:
        parser.error(f"no robot '{unknown[0]}'; there are: {', '.join(robots)}")
    figures = Figures(options.json)
    for name in options.names or robots:
        try:
            figures.row(name, **measure(*robots[name], options.duration))
        except SolferError as error:
            figures.row(name, refused=why(error))


if __name__ == "__main__":
    main()

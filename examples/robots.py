"""The robots of listing_2.py to listing_4.py: CENTAURO, and TALOS from `example-robot-data`."""

import argparse
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from solfer import Robot

HERE = Path(__file__).parent
CENTAURO = HERE.parent / "config/robots/centauro"
TALOS = "cmeel.prefix/share/example-robot-data/robots/talos_data/robots/talos_reduced.urdf"


@dataclass(frozen=True)
class Names:
    """A robot's names of its hands (a group of the SRDF), its torso, its base, and a posture to start in."""

    hands: str
    torso: str
    base: str
    posture: str


NAMES = {
    "centauro": Names("manipulation", "torso_2", "pelvis", "home"),
    "talos": Names("hands", "torso_2_link", "base_link", "half_sitting"),
}


def choose(description: str, floating_base: bool = True) -> tuple[Robot, Names]:
    """Make the robot that the command line names, in its posture; returns its names, too."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("robot", nargs="?", choices=NAMES, default="centauro", help="default: %(default)s")
    name = parser.parse_args().robot
    urdf, srdf = CENTAURO / "centauro.urdf", CENTAURO / "centauro.srdf"
    if name == "talos":
        try:
            urdf, srdf = distribution("example-robot-data").locate_file(TALOS), HERE / "talos.srdf"
        except PackageNotFoundError:
            parser.exit(2, "error: TALOS is not installed\n  expected: pip install -r requirements-examples.txt\n")
    robot, names = Robot.load(str(urdf), srdf, floating_base), NAMES[name]
    indices, values = robot.named_state(names.posture)
    robot.state.position[indices] = values
    robot.update()
    return robot, names

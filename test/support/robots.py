"""Robots for tests, whose files are read once in a process; CENTAURO is the shipped one."""

from copy import deepcopy
from functools import cache
from pathlib import Path

from solfer import Robot
from solfer.model import Description
from solfer.model.urdf.cut import cut

CENTAURO = Path(__file__).parents[2] / "config/robots/centauro"
"""Folder of its files."""

URDF, SRDF, CONTACTS = (CENTAURO / name for name in ("centauro.urdf", "centauro.srdf", "contacts.yaml"))

_read = cache(Robot.load)


def load(*files, **options) -> Robot:
    """Load a Robot as `Robot.load` does; its states, limits and kinematics are its own."""
    robot = _read(*files, **options).twin()
    robot.lower_limits, robot.upper_limits = deepcopy((robot.lower_limits, robot.upper_limits))
    robot.added_revolutions = robot.added_revolutions.copy()
    return robot


def in_state(robot: Robot, name: str = "mammal_wide_straight") -> Robot:
    """Put a robot into a named state."""
    indices, values = robot.named_state(name)
    robot.state.position[indices] = values
    robot.update()
    return robot


def centauro(state: str = "", *, contacts: bool = True, actuators: bool = False) -> Robot:
    """Load CENTAURO, and put it into a named state."""
    files = {"contacts": CONTACTS} if contacts else {}
    if actuators:
        files["actuators"] = CENTAURO / "actuators.yaml"
    robot = load(URDF, SRDF, **files)
    return in_state(robot, state) if state else robot


@cache
def _part(keep: str) -> str:
    return cut(Description.from_file(URDF), "torso_2", keep)


def lower_body() -> Robot:
    """Load CENTAURO's lower body with the contacts of its wheels."""
    return load(_part("lower"), SRDF, contacts=CONTACTS, others=(URDF,), name="centauro")


def upper_body() -> Robot:
    """Load the upper body, which has a fixed base, and put its joints into `mammal_wide_straight`."""
    return in_state(load(_part("upper"), SRDF, others=(URDF,)))

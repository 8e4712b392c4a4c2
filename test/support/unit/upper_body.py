"""CENTAURO's upper body, which has a fixed base, in a posture for its arms."""

from pathlib import Path

from solfer import Robot
from solfer.model import Description
from solfer.model.urdf.cut import cut


def upper_body(repository: Path) -> Robot:
    """Load the upper body and put its joints into `mammal_wide_straight`."""
    folder = repository / "config/robots/centauro"
    whole = folder / "centauro.urdf"
    text = cut(Description.from_file(whole), "torso_2", "upper")
    robot = Robot.load(text, folder / "centauro.srdf", others=[whole])
    dofs, values = robot.named_state("mammal_wide_straight")
    robot.state.position[dofs] = values
    robot.update()
    return robot

"""The centre of mass as a point."""

import numpy as np

from solfer.model.view import KinematicTree, RobotView
from solfer.points.compiled import layout
from solfer.points.program import CompiledPoint, Instruction


class CenterOfMass(CompiledPoint):
    """Centre of mass of all links that a DoF moves, in the world [m].

    Args:
        robot: The Robot.
    """

    def __init__(self, robot: RobotView):
        super().__init__(3, robot)
        tree = robot.kinematics.tree
        moments = np.zeros(3 * len(tree.masses))
        self._numbers = np.concatenate((tree.masses, tree.levers.ravel(), subtree_masses(tree), moments))

    def instructions(self) -> tuple[Instruction, ...]:
        """What the kernel has to do for this point alone."""
        return (Instruction(layout.CENTER_OF_MASS, self, numbers=self._numbers,
                            table=self.robot.kinematics.tree.parents),)


def subtree_masses(tree: KinematicTree) -> np.ndarray:
    """Mass of each joint and all that it carries [kg], shape (n + 1,)."""
    masses = tree.masses.copy()
    for joint in range(len(masses) - 1, 0, -1):
        masses[tree.parents[joint]] += masses[joint]
    return masses

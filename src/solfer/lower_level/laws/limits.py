"""Limits of the joints of a controller."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solfer.errors import UnknownName
from solfer.model.kinematics import Kinematics


@dataclass(frozen=True)
class JointLimits:
    """Limits of joints; all arrays have the shape (len(joints),).

    Attributes:
        joints: Names of the joints, in the order of the arrays.
        dofs: DoFs of the joints in the model.
        lower: Smallest position [rad, m], minus infinity without a limit.
        upper: Largest position [rad, m], infinity without a limit.
        velocity: Largest speed [rad/s, m/s].
        effort: Largest torque or force [Nm, N].
    """

    joints: tuple[str, ...]
    dofs: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    velocity: np.ndarray
    effort: np.ndarray

    @classmethod
    def from_model(cls, kinematics: Kinematics, joints: Sequence[str], where: str = "") -> "JointLimits":
        """Read the limits of `joints` from the model.

        Raises:
            UnknownName: The model has no such DoF; `where` is the place that names it.
        """
        place = {name: index for index, name in enumerate(kinematics.dofs)}
        for name in joints:
            if name not in place:
                raise UnknownName("joint", name, kinematics.dofs, where=where)
        dofs = np.array([place[name] for name in joints], dtype=np.intp)
        return cls(
            tuple(joints),
            dofs,
            kinematics.lower_position[dofs],
            upper=kinematics.upper_position[dofs],
            velocity=kinematics.velocity_limit[dofs],
            effort=kinematics.effort_limit[dofs],
        )

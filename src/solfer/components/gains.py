"""Stiffness and damping that components command, by groups of joints."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import Field

from solfer.config import NameOf, Record
from solfer.config.records.bounds import GAIN
from solfer.robot import Robot

GAINS = ("stiffness", "damping")
"""Gains of a group."""


class GainsOfGroup(Record):
    """Stiffness and damping of the springs at the joints of a group."""

    chain: Annotated[str, NameOf("group")] = Field(description="SRDF group of the joints")
    stiffness: float | None = Field(None, **GAIN, description="stiffness [Nm/rad, N/m]; the lower level's, if left out")
    damping: float | None = Field(None, **GAIN, description="damping [Nms/rad, Ns/m]; the lower level's, if left out")


def configured_gains(robot: Robot, groups: Sequence[GainsOfGroup]) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """List stiffness and damping where they are configured: the desired State's array, DoFs and their numbers."""
    gains = []
    for gain in GAINS:
        numbers = np.full(robot.size, np.nan)
        for group in groups:
            if getattr(group, gain) is not None:
                numbers[robot.selectors[group.chain].indices] = getattr(group, gain)
        dofs = np.flatnonzero(np.isfinite(numbers))
        if len(dofs):
            gains.append((robot.command.add(gain), dofs, numbers[dofs]))
    return gains

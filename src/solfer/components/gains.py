"""Stiffness and damping that components command, by groups of joints."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from solfer.config import LIVE, NameOf, Record
from solfer.config.records.bounds import GAIN
from solfer.errors import ComponentError
from solfer.interfaces.declaration import LiveParameter
from solfer.robot import Robot

GAINS = ("stiffness", "damping")
"""Gains of a group."""


class GainsOfGroup(Record):
    """Stiffness and damping of the springs at the joints of a group."""

    chain: Annotated[str, NameOf("group")] = Field(description="SRDF group of the joints")
    stiffness: float | None = Field(
        None, **GAIN, **LIVE, description="stiffness [Nm/rad, N/m]; the lower level's, if left out"
    )
    damping: float | None = Field(
        None, **GAIN, **LIVE, description="damping [Nms/rad, Ns/m]; the lower level's, if left out"
    )


def configured_gains(robot: Robot, groups: Sequence[GainsOfGroup]) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """List stiffness and damping where they are configured: the desired State's array, DoFs and their numbers."""
    gains = []
    for gain in GAINS:
        numbers = _numbers(robot, gain, groups)
        dofs = np.flatnonzero(np.isfinite(numbers))
        if len(dofs):
            gains.append((robot.command.add(gain), dofs, numbers[dofs]))
    return gains


def live_gains(
    robot: Robot, groups: Sequence[GainsOfGroup], gains: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]
) -> Iterator[LiveParameter]:
    """Yield those gains of groups, the tag `gains`, that are configured, as parameters.

    Args:
        robot: The Robot.
        groups: The groups.
        gains: What `configured_gains` has made of them; the numbers are live.
    """
    present = [gain for gain in GAINS if np.isfinite(_numbers(robot, gain, groups)).any()]
    for gain, (_, dofs, numbers) in zip(present, gains, strict=True):
        write = partial(np.copyto, numbers)
        of_tags = partial(_numbers_of_tags, robot, gain, dofs)
        for index, group in enumerate(groups):
            if getattr(group, gain) is not None:
                yield LiveParameter(("gains", index, gain), write, of_tags)


def _numbers_of_tags(robot: Robot, gain: str, dofs: np.ndarray, tags: Any) -> np.ndarray:
    """Return the numbers of DoFs; one that is left out now is refused: the pipes carry it."""
    numbers = _numbers(robot, gain, tags.gains)[dofs]
    if np.isnan(numbers).any():
        raise ComponentError(f"a {gain} is left out while the robot has it", expected="a number")
    return numbers


def _numbers(robot: Robot, gain: str, groups: Sequence[GainsOfGroup]) -> np.ndarray:
    """Return a gain of all DoFs, NaN where no group has it, shape (n,)."""
    numbers = np.full(robot.size, np.nan)
    for group in groups:
        if getattr(group, gain) is not None:
            numbers[robot.selectors[group.chain].indices] = getattr(group, gain)
    return numbers

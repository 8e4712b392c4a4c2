"""What a robot in an engine does, as tuples that can be compared."""

from typing import NamedTuple

import numpy as np


class JointStates(NamedTuple):
    """Positions, velocities and efforts of the joints."""

    position: tuple[float, ...]
    velocity: tuple[float, ...]
    effort: tuple[float, ...]


class BaseState(NamedTuple):
    """Pose and twist of the base link."""

    position: tuple[float, ...]
    orientation: tuple[float, ...]
    linear: tuple[float, ...]
    angular: tuple[float, ...]


def joint_states(robot):
    """Read the joints of a robot, of which each moves a link."""
    numbers = np.zeros((3, len(robot.links) - 1))
    robot.read_joints(*numbers)
    return JointStates(*map(tuple, numbers.tolist()))


def base_state(robot):
    """Read the base of a robot."""
    motion = np.zeros(13)
    robot.read_base(motion)
    numbers = motion.tolist()
    return BaseState(*(tuple(numbers[place]) for place in (slice(4, 7), slice(4), slice(7, 10), slice(10, 13))))

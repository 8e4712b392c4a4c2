"""Gains of a controller's joints from a file."""

from typing import NamedTuple

import numpy as np

from solfer.config import read
from solfer.config.files import located
from solfer.errors import ConfigError, UnknownName
from solfer.lower_level.controller import ImpedanceController
from solfer.lower_level.records import GainsRecord


class Gains(NamedTuple):
    """Stiffness [Nm/rad] and damping [Nms/rad] of a controller's joints, in its order."""

    stiffness: np.ndarray
    damping: np.ndarray


def read_gains(controller: ImpedanceController, file: str, robot: str = "") -> Gains:
    """The gains that a file has for a controller. Takes some milliseconds; the controller stays as it is.

    Args:
        controller: The controller.
        file: An absolute path or `package://...`.
        robot: Key of the robot's part in the file; empty: there is none.

    Raises:
        ConfigError, UnknownName, SolferErrors: The file is wrong, or has no gains for a joint of the controller.
    """
    path = located(file, "")
    if not path.is_absolute():
        raise ConfigError(f"'{file}' is not an absolute path", expected="a path from / on, or package://NAME/...")
    record = read(path, GainsRecord, (robot,) if robot else ())
    missing = [joint for joint in controller.joints if joint not in record.gains]
    if missing:
        raise UnknownName("joint", missing[0], record.gains, where=record.where("gains"),
                          expected=f"gains of every joint of controller '{controller.name}'")
    gains = [record.gains[joint] for joint in controller.joints]
    return Gains(np.array([gain.stiffness for gain in gains]), np.array([gain.damping for gain in gains]))

"""Reads the gains of a controller's joints from a file."""

from typing import NamedTuple

import numpy as np

from solfer.config import read
from solfer.config.yaml.folders import Folders
from solfer.errors import UnknownName
from solfer.lower_level.laws.controllers import ImpedanceController
from solfer.lower_level.records import GainsRecord


class Gains(NamedTuple):
    """Stiffness [Nm/rad] and damping [Nms/rad] of a controller's joints, in its order."""

    stiffness: np.ndarray
    damping: np.ndarray


def read_gains(controller: ImpedanceController, file: str, folders: Folders, robot: str = "") -> Gains:
    """Read the gains of a controller from a file. This needs some milliseconds; the controller stays as it is.

    Args:
        controller: The controller.
        file: An absolute path or `package://...`.
        folders: Folders from which it may be read.
        robot: Key of the robot's part in the file; empty: the file has no such key.

    Raises:
        ConfigError, UnknownName, SolferErrors: The file may not be read, is wrong, or has no gains for a joint of the
            controller.
    """
    record = read(folders.file(file), GainsRecord, (robot,) if robot else ())
    missing = [joint for joint in controller.joints if joint not in record.gains]
    if missing:
        raise UnknownName(
            "joint",
            missing[0],
            record.gains,
            where=record.where("gains"),
            expected=f"gains of every joint of controller '{controller.name}'",
        )
    gains = [record.gains[joint] for joint in controller.joints]
    return Gains(np.array([gain.stiffness for gain in gains]), np.array([gain.damping for gain in gains]))

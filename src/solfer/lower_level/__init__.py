"""A robot's own controllers: impedance and velocity laws, and the checks of their commands."""

from solfer.lower_level.builder import build_lower_level
from solfer.lower_level.laws.controllers import ImpedanceController, LowerLevelController, VelocityController
from solfer.lower_level.laws.impedance import ImplicitImpedance
from solfer.lower_level.laws.limits import JointLimits
from solfer.lower_level.lower_level import LowerLevel
from solfer.lower_level.records import GainRecord, GainsRecord, JointControllerRecord, LowerLevelRecord
from solfer.lower_level.server.server import LowerLevelServer

__all__ = [
    "LowerLevelController",
    "GainRecord",
    "GainsRecord",
    "ImpedanceController",
    "ImplicitImpedance",
    "JointControllerRecord",
    "JointLimits",
    "LowerLevel",
    "LowerLevelRecord",
    "LowerLevelServer",
    "VelocityController",
    "build_lower_level",
]

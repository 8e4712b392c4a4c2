"""What a robot's own controllers do: impedance and velocity laws, and the checks of their commands."""

from solfer.lower_level.build import build_lower_level
from solfer.lower_level.controller import Controller, ImpedanceController, VelocityController
from solfer.lower_level.impedance import ImplicitImpedance
from solfer.lower_level.limits import JointLimits
from solfer.lower_level.lower_level import LowerLevel
from solfer.lower_level.records import GainRecord, GainsRecord, JointControllerRecord, LowerLevelRecord
from solfer.lower_level.server import LowerLevelServer

__all__ = [
    "Controller",
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

"""Dynamics of a robot, computed when they are used and its state has changed (section 1.2 of the paper)."""

from solfer.dynamics.carrying import CarryingTorques
from solfer.dynamics.dynamic_model import DynamicModel
from solfer.dynamics.elements import BIAS, INERTIA, INERTIA_INVERSE
from solfer.dynamics.projected import ProjectedDynamics
from solfer.dynamics.update_manager import UpdateManager

__all__ = [
    "BIAS",
    "INERTIA",
    "INERTIA_INVERSE",
    "CarryingTorques",
    "DynamicModel",
    "ProjectedDynamics",
    "UpdateManager",
]

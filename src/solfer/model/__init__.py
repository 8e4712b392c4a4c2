"""Models of robots: description, semantics, maps, State, kinematics, actuators.

Names are imported when they are first used, so that reading or cutting a URDF does not load Pinocchio.
"""

from importlib import import_module
from typing import Any

_HOMES = {
    "Actuators": "actuators",
    "BidirectionalMap": "maps",
    "Description": "urdf.description",
    "Group": "srdf.semantics",
    "History": "history",
    "JointInfo": "urdf.elements",
    "Kinematics": "kinematics",
    "LinkInfo": "urdf.elements",
    "Maps": "maps",
    "Semantics": "srdf.semantics",
    "SeriesElastic": "actuators",
    "State": "state",
    "UnidirectionalMap": "maps",
}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)

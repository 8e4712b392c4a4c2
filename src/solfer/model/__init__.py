"""Models of robots: description, semantics, maps, State, kinematics, actuators.

Names are imported when they are first used, so that reading or cutting a URDF does not load Pinocchio.
"""

from solfer.lazy import lazy

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


__getattr__ = lazy(__name__, _HOMES)

"""Robot Points and Handler (sections 1.3 and 1.4 of the paper): values with their Jacobians, updated as a group.

Names are imported when they are first used: the compiled kernel behind them takes a while to load.
"""

from importlib import import_module
from typing import Any

_HOME = {
    "Acceleration": "acceleration",
    "AngularAcceleration": "acceleration",
    "AngularMomentum": "whole_body",
    "AngularVelocity": "rigid",
    "BallContact": "contact.contacts",
    "CenterOfMass": "whole_body",
    "CenterOfPressure": "whole_body",
    "Constant": "algebra",
    "ConstraintForce": "contact.constraint_force",
    "ContactConstraint": "contact.contact_constraint",
    "ContactForces": "contact.contact_forces",
    "DynamicPoint": "dynamic",
    "Force": "contact.constraint_force",
    "FrameOrientation": "rigid",
    "Handler": "handler",
    "LinearAcceleration": "acceleration",
    "LinearPoint": "rigid",
    "LinearVelocity": "rigid",
    "Minus": "algebra",
    "Norm": "algebra",
    "ORIENTATION": "space",
    "POSE": "space",
    "Plus": "algebra",
    "Point": "point",
    "PointContact": "contact.contacts",
    "Posture": "whole_body",
    "RollingAcceleration": "acceleration",
    "RollingContact": "contact.contacts",
    "SpatialAcceleration": "acceleration",
    "SpatialPoint": "rigid",
    "SpatialVelocity": "rigid",
    "SupportVertex": "contact.support_vertex",
    "SupportVertexAcceleration": "acceleration",
    "Torque": "contact.constraint_force",
    "Wrench": "contact.constraint_force",
    "make_contact": "contact.contacts",
    "vector": "space",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)

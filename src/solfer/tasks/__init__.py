"""Tasks and their hierarchies (inverse kinematics): goals for points of a robot, in the order of priority.

Names are imported when they are first used: the compiled kernels behind them take a while to load.
"""

from importlib import import_module
from typing import Any

_HOMES = {
    "CollisionLimit": "collisions",
    "ConfiguredStack": "building.build",
    "Constraint": "constraints",
    "Hierarchy": "hierarchy",
    "Levels": "stack",
    "Policy": "qp_hierarchy",
    "QpFailed": "qp_hierarchy",
    "QpHierarchy": "qp_hierarchy",
    "ReferenceIntegrator": "integrator",
    "Stack": "stack",
    "Task": "task",
    "TaskController": "controller",
    "TorqueLimits": "constraints",
    "WorkspaceLimit": "constraints",
    "build_stack": "building.build",
    "joint_bounds": "constraints",
}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)

"""Tasks and their hierarchies (inverse kinematics): goals for points of a robot, in the order of priority.

Names are imported when they are first used: the compiled kernels behind them take a while to load.
"""

from solfer.lazy import lazy

_HOMES = {
    "CollisionLimit": "collisions",
    "ConfiguredStack": "building.build",
    "Constraint": "constraints",
    "Hierarchy": "hierarchy",
    "Levels": "stack",
    "QpPolicy": "qp_hierarchy",
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


__getattr__ = lazy(__name__, _HOMES)

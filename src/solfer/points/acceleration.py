"""Accelerations as Dynamic Points: A x + b with x the accelerations of the DoFs, and b = dJ/dt v."""

import numpy as np

from solfer.points.compiled.acceleration import material_acceleration, rolling_acceleration, vertex_acceleration
from solfer.points.compiled.instruction import ANGULAR, LINEAR
from solfer.points.compiled.rigid import velocity
from solfer.points.compiled.wheels import rolling, vertex
from solfer.points.contact.support_vertex import SupportVertex
from solfer.points.dynamic import CompiledDynamicPoint, DynamicPoint
from solfer.points.rigid import LinearPoint, RigidPoint
from solfer.points.space import vector

__all__ = [
    "Acceleration",
    "AngularAcceleration",
    "LinearAcceleration",
    "RollingAcceleration",
    "SpatialAcceleration",
    "SupportVertexAcceleration",
]


class Acceleration(DynamicPoint):
    """An acceleration A x + b with x the accelerations of the DoFs; a base class."""

    @property
    def x(self) -> np.ndarray:
        """Accelerations of the DoFs, `robot.state.acceleration`, shape (n,) [rad/s^2, m/s^2]; live."""
        return self.robot.state.acceleration


class _CompiledAcceleration(CompiledDynamicPoint, Acceleration):
    """An acceleration that the kernel computes."""


class LinearAcceleration(LinearPoint, _CompiledAcceleration):
    """Acceleration of a point on a link in world axes [m/s^2], without gravity.

    A x + b with x the accelerations of the DoFs, `robot.state.acceleration`; A is the Jacobian J of the point, b is
    dJ/dt v. Arguments: `LinearPoint`.
    """

    kernels = (velocity, material_acceleration)


class AngularAcceleration(RigidPoint, _CompiledAcceleration):
    """Angular acceleration of a link in world axes [rad/s^2].

    A x + b with x the accelerations of the DoFs, `robot.state.acceleration`; A is the Jacobian J of the link's
    orientation, b is dJ/dt v. Arguments: `AngularVelocity`.
    """

    kind = vector(3)
    kernels = (velocity, material_acceleration)
    motion = ANGULAR


class SpatialAcceleration(LinearPoint, _CompiledAcceleration):
    """Acceleration of a point on a link, then angular acceleration of the link, world axes [m/s^2, rad/s^2].

    A x + b with x the accelerations of the DoFs, `robot.state.acceleration`; A is the Jacobian J of the
    `SpatialVelocity`, b is dJ/dt v. Arguments: `LinearPoint`.
    """

    kind = vector(6)
    kernels = (velocity, material_acceleration)
    motion = LINEAR + ANGULAR


class SupportVertexAcceleration(SupportVertex, _CompiledAcceleration):
    """Acceleration of the vertex of the support polygon below a wheel, in world axes [m/s^2].

    A x + b with x the accelerations of the DoFs, `robot.state.acceleration`; A is the Jacobian J of the
    `SupportVertex`, b is dJ/dt v. That of a wheel that lies flat is the acceleration of its centre. Arguments:
    `SupportVertex`.
    """

    kernels = (vertex, vertex_acceleration)


class RollingAcceleration(SupportVertex, _CompiledAcceleration):
    """Rate of change of the velocity that a wheel's material has at its contact with the ground, world axes [m/s^2].

    It is zero while a wheel rolls without slip; unlike a `LinearAcceleration` it follows the place of contact from
    one particle of the wheel to the next. A x + b with x the accelerations of the DoFs, `robot.state.acceleration`; A
    is the Jacobian J of the `RollingContact`, b is dJ/dt v. Arguments: `SupportVertex`.
    """

    kernels = (rolling, rolling_acceleration)

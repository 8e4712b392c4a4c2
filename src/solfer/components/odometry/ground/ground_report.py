"""The ground as odometry has it, for other components."""

import math

import numpy as np

from solfer.components.odometry.filter import FilteredOdometry
from solfer.components.odometry.kalman import PLANE_DEVIATION
from solfer.components.odometry.kalman_kernel import SLOPE, TILT
from solfer.components.odometry.sensing.measured_base import about_vertical
from solfer.components.odometry.wheels import Wheels
from solfer.interfaces.geometry import Vector
from solfer.interfaces.ground import GroundEstimate


def report_ground(law: FilteredOdometry, wheels: Wheels) -> GroundEstimate:
    """Describe the ground at the last measurement: one plane, at the height of the wheels that touch it."""
    count = len(wheels)
    lifted = law.lifted
    places = np.array([law.position + about_vertical(arm, law.heading) for arm in wheels.arms])
    places[:, 2] -= np.where(lifted, law.ground.rise, 0.0)
    point = places[lifted == lifted.all()].mean(axis=0)  # where all are lifted, below them
    normal = Vector(*about_vertical(wheels.ground.normal, law.heading).tolist())
    # a level floor is one within the slopes of floors; the plane of a slope is measured with the error of the tilt
    covariance = law.kalman.covariance
    first = SLOPE if wheels.ground.is_level else TILT
    turned = math.sqrt(float(max(covariance[first, first], covariance[first + 1, first + 1])) + PLANE_DEVIATION**2)
    return GroundEstimate(
        names=wheels.names,
        places=tuple(Vector(*place) for place in places.tolist()),
        normals=(normal,) * count,
        height_deviations=(math.sqrt(float(covariance[2, 2])),) * count,
        normal_deviations=(turned,) * count,
        friction=(math.nan,) * count,
        point=Vector(*point.tolist()),
        normal=normal,
    )

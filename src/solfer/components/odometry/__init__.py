"""Where the base is, from wheels and IMU."""

from solfer.components.odometry.component import Odometry

__all__ = ["Odometry"]

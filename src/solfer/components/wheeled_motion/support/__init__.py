"""What carries the robot: the support polygon, and wheels that leave it and come back."""

from solfer.components.wheeled_motion.support.guard import MotionGuard, TaskRates
from solfer.components.wheeled_motion.support.lifting import Lifting
from solfer.components.wheeled_motion.support.polygon import SupportPolygon
from solfer.components.wheeled_motion.support.step import LegReach, LoadBalance, Stepping
from solfer.components.wheeled_motion.support.weight import WeightShift

__all__ = [
    "LegReach",
    "Lifting",
    "LoadBalance",
    "MotionGuard",
    "Stepping",
    "SupportPolygon",
    "TaskRates",
    "WeightShift",
]

"""Numerics without a robot: rotations, the chart of a floating base, ramps."""

from solfer.numerics.base_chart import BaseChart
from solfer.numerics.ramp import Ramp

__all__ = ["BaseChart", "Ramp"]

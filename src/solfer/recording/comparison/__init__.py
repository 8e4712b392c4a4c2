"""Comparison of two recordings of the same motion: which joint differs first, and how (docs/reference/logs.md)."""

from solfer.recording.comparison.compare import Comparison, compare
from solfer.recording.comparison.verdict import Difference, JointVerdict

__all__ = ["Comparison", "Difference", "JointVerdict", "compare"]

"""Inverse kinematics: joints that let points of a robot follow references (Figs. 2 to 5 of the paper)."""

from solfer.components.inverse_kinematics.component import InverseKinematics

__all__ = ["InverseKinematics"]

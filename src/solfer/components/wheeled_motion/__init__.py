"""Wheeled motion: a legged robot drives, steers and changes its footprint at the same time."""

from solfer.components.wheeled_motion.component import WheeledMotion

__all__ = ["WheeledMotion"]

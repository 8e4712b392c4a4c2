"""PyBullet as a physics engine: the only folder that imports and calls it."""

from solfer.simulation.bullet.client import load_pybullet
from solfer.simulation.bullet.engine import BulletEngine

__all__ = ["BulletEngine", "load_pybullet"]

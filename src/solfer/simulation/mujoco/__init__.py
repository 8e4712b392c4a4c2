"""MuJoCo as a physics engine: the only folder that imports and calls it."""

from solfer.simulation.mujoco.engine import MujocoEngine
from solfer.simulation.mujoco.library import load_mujoco

__all__ = ["MujocoEngine", "load_mujoco"]

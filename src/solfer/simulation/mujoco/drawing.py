"""Pictures of a world, drawn without a display."""

from solfer.simulation.mujoco.world import MujocoWorld
from solfer.simulation.physics import CameraView, Picture


def draw(world: MujocoWorld, view: CameraView) -> Picture:
    """Draw what a camera sees, see `PhysicsEngine.render`."""
    raise NotImplementedError

"""What a robot and its plugins look like, from topics alone: for RViz, and for all else that draws it."""

from solfer_tools.scene.dragging import DraggedReferences
from solfer_tools.scene.live_scene import LiveScene
from solfer_tools.scene.state import ContactForce, ScenePose, SceneState, ShownReference
from solfer_tools.scene.world import ShownWorld, WorldSurface

__all__ = [
    "ContactForce",
    "DraggedReferences",
    "LiveScene",
    "ScenePose",
    "SceneState",
    "ShownReference",
    "ShownWorld",
    "WorldSurface",
]

"""A scene in RViz: markers, tf of the desired robot, and references that an operator drags."""

from solfer.middleware.ros.scene.markers import SceneMarkers
from solfer.middleware.ros.scene.reference_markers import ReferenceMarkers

__all__ = ["ReferenceMarkers", "SceneMarkers"]

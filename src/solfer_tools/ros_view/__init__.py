"""What ROS's tools show: a scene in RViz, and references that an operator drags."""

from solfer_tools.ros_view.markers import SceneMarkers
from solfer_tools.ros_view.reference_markers import ReferenceMarkers

__all__ = ["ReferenceMarkers", "SceneMarkers"]

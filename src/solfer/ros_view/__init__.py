"""What ROS's tools show: a scene in RViz, references that an operator drags, statistics of a real-time layer."""

from solfer.ros_view.markers import SceneMarkers
from solfer.ros_view.reference_markers import ReferenceMarkers

__all__ = ["ReferenceMarkers", "SceneMarkers"]

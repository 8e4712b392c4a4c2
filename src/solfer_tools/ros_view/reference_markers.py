"""References as interactive markers."""

from collections import deque

import numpy as np
from geometry_msgs.msg import Quaternion
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, InteractiveMarkerFeedback

from solfer.errors import NotFinite
from solfer.interfaces.geometry import bare_frame
from solfer.middleware.ros.tf import prefixed
from solfer.numerics.rotations import rotation_from_quaternion
from solfer_tools.ros_view.markers import pose_of
from solfer_tools.scene import DraggedReferences, ScenePose, SceneState, ShownReference
from solfer_tools.scene.live_scene import WORLD


class ReferenceMarkers:
    """An interactive marker on `~references` for each reference of a scene; what an operator drags is published.

    Args:
        dragged: Publishes it.
        prefix: In front of the frames of the robot, see `tf_prefix`.
    """

    def __init__(self, dragged: DraggedReferences, prefix: str = ""):
        self._dragged = dragged
        self._prefix = prefix
        self._server = InteractiveMarkerServer("~references")
        self._received = deque[InteractiveMarkerFeedback](maxlen=1000)  # rospy calls from threads of its own
        self._shown: dict[str, ShownReference] = {}
        self._frames: dict[str, str] = {}
        self._placed: dict[str, ScenePose] = {}  # but for markers that an operator has moved

    def update(self, state: SceneState) -> None:
        """Take over what was dragged, and let the other markers follow their references."""
        present = {f"{each.module}/{each.task}": each for each in state.references}
        for name in self._shown.keys() - present.keys():
            self._server.erase(name)
            self._frames.pop(name)
        self._shown = present
        while self._received:
            self._take(self._received.popleft())
        for name, shown in present.items():
            frame = state.frame if shown.frame == WORLD else prefixed(self._prefix, shown.frame)
            if self._frames.get(name) != frame:
                self._frames[name] = frame
                self._server.insert(_made(name, frame, shown), self._received.append)
            elif self._dragged.is_dragged(shown) or not _differs(self._placed.get(name), shown.own):
                continue
            else:
                self._server.setPose(name, pose_of(shown.own))
            self._placed[name] = shown.own
        self._server.applyChanges()

    def _take(self, feedback: InteractiveMarkerFeedback) -> None:
        shown = self._shown.get(feedback.marker_name)
        if shown is None or bare_frame(feedback.header.frame_id) != self._frames.get(feedback.marker_name):
            return
        if feedback.event_type == feedback.MOUSE_UP:
            self._dragged.release(shown, feedback.client_id)
        elif feedback.event_type == feedback.POSE_UPDATE:
            place = feedback.pose.position
            rotation = feedback.pose.orientation
            position = np.array((place.x, place.y, place.z))
            try:
                pose = ScenePose(position, rotation_from_quaternion((rotation.x, rotation.y, rotation.z, rotation.w)))
            except NotFinite:
                return
            if np.isfinite(position).all():
                self._placed.pop(feedback.marker_name, None)
                self._dragged.drag(shown, feedback.client_id, pose)
        elif feedback.event_type == feedback.KEEP_ALIVE:
            self._dragged.drag(shown, feedback.client_id)


def _made(name: str, frame: str, shown: ShownReference) -> InteractiveMarker:
    half = np.sqrt(0.5)
    rotations = {  # quaternions that rotate the axis x of a control to each axis
        "x": Quaternion(half, 0.0, 0.0, half),
        "y": Quaternion(0.0, 0.0, half, half),
        "z": Quaternion(0.0, half, 0.0, half),
    }
    move = InteractiveMarkerControl.MOVE_AXIS
    rotate = InteractiveMarkerControl.ROTATE_AXIS
    modes = {"position": (move,), "orientation": (rotate,), "pose": (move, rotate)}
    made = InteractiveMarker(name=name, description=name, scale=0.25, pose=pose_of(shown.own))
    made.header.frame_id = frame
    for mode in modes[shown.quantity]:
        for axis, rotation in rotations.items():
            control = InteractiveMarkerControl(name=f"{axis}{mode}", interaction_mode=mode, orientation=rotation)
            made.controls.append(control)
    return made


def _differs(first: ScenePose | None, second: ScenePose) -> bool:
    if first is None:
        return True
    away = np.abs(first.position - second.position).max(), np.abs(first.rotation - second.rotation).max()
    return not max(away) < 1e-3  # [m], of the rotation's numbers [1]

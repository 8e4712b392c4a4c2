"""Markers and transforms of a scene."""

import io
import math
from collections.abc import Iterable, Iterator, Sequence

import genpy
import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, TransformStamped, Vector3
from std_msgs.msg import ColorRGBA
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from solfer.middleware.ros.codecs.packed_message import PackedMessage, present
from solfer.middleware.ros.tf import prefixed
from solfer.middleware.ros.topic_publisher import TopicPublisher
from solfer.numerics.rotations import quaternion_from_rotation
from solfer_tools.scene import ContactForce, ScenePose, SceneState, ShownReference, WorldSurface
from solfer_tools.scene.live_scene import WORLD

FORCE_SCALE = 1e-3
"""Length of the arrow of a force [m/N]."""

AXES_LENGTH = 0.1
"""Length of the axes of a reference [m]."""

WORLD_COLOR = (0.58, 0.55, 0.50, 1.0)
"""Color of a world."""

MEASURED_COLOR = (0.1, 0.4, 0.9, 1.0)
"""Color of what is measured: red, green, blue, opacity."""


class SceneMarkers:
    """Publishes a scene: `~markers` `~world` (visualization_msgs/MarkerArray, latched), and the desired links on /tf.

    Namespaces of the markers are `center`, `polygon`, `margins`, `forces`, `cones`, `references`, `desired` (where
    references go), `names` and `path`.

    Args:
        prefix: In front of the frames of the robot, see `tf_prefix`.
    """

    def __init__(self, prefix: str = ""):
        self._prefix = prefix
        self._markers = TopicPublisher("~markers", MarkerArray)
        self._world = TopicPublisher("~world", MarkerArray, latch=True)
        self._transforms = TopicPublisher("/tf", TFMessage)

    def publish(self, state: SceneState) -> None:
        """Publish what is seen."""
        if self._markers.has_subscribers():
            self._markers.send(_packed(MarkerArray(markers=list(markers_of(state)))))
        if state.desired and self._transforms.has_subscribers():
            self._transforms.send(_packed(TFMessage(list(self._placed(state)))))

    def publish_world(self, surfaces: Sequence[WorldSurface]) -> None:
        """Publish the world, in place of the one before."""
        message = MarkerArray(markers=list(world_markers(surfaces)))
        self._world.latch(message)
        self._world.send(_packed(message))

    def close(self) -> None:
        """Unregister."""
        self._markers.close()
        self._world.close()
        self._transforms.close()

    def _placed(self, state: SceneState) -> Iterator[TransformStamped]:
        stamp = genpy.Time(*present())
        for link, pose in state.desired.items():
            made = TransformStamped(child_frame_id=prefixed(self._prefix, f"desired/{link}"))
            made.header.frame_id = state.frame
            made.header.stamp = stamp
            placed = pose_of(pose)
            made.transform.translation = Vector3(*pose.position.tolist())
            made.transform.rotation = placed.orientation
            yield made


def pose_of(pose: ScenePose) -> Pose:
    """Make a geometry_msgs/Pose."""
    return Pose(Point(*pose.position.tolist()), Quaternion(*quaternion_from_rotation(pose.rotation).tolist()))


def markers_of(state: SceneState) -> Iterator[Marker]:
    """Make the markers of a scene."""
    for made in _markers(state):
        made.header.frame_id = state.frame
        made.lifetime = genpy.Duration.from_sec(0.5)  # disappears unless it is published again
        yield made


def world_markers(surfaces: Iterable[WorldSurface]) -> Iterator[Marker]:
    """Make the markers of a world, behind one that deletes those of another one."""
    yield Marker(action=Marker.DELETEALL)
    for index, surface in enumerate(surfaces):
        made = _marker(surface.name, index, Marker.TRIANGLE_LIST, scale=(1.0, 1.0, 1.0), color=WORLD_COLOR)
        made.header.frame_id = WORLD
        made.points = [_point(place) for place in surface.vertices[surface.faces].reshape(-1, 3)]
        yield made


def _markers(state: SceneState) -> Iterator[Marker]:
    projected = (0.9, 0.2, 0.2, 1.0)
    yield _ball("center", 0, state.center, size=0.08, color=MEASURED_COLOR)
    yield _ball("center", 1, state.projection, size=0.05, color=projected)
    yield _lines("center", 2, [state.center, state.projection], width=0.005, color=projected)
    for name, corners, color in (
        ("polygon", state.polygon, (0.1, 0.7, 0.2, 1.0)),
        ("margins", state.inner, (0.9, 0.7, 0.1, 1.0)),
    ):
        if len(corners):
            yield _lines(name, 0, [*corners, corners[0]], width=0.015, color=color)
    for index, force in enumerate(state.forces):
        if force.touches:
            yield _arrow(index, force)
            yield _cone(index, force, state.friction)
    for index, reference in enumerate(state.references):
        yield _frame(index, reference)
        yield _ball("desired", index, reference.desired.position, size=0.03, color=(0.5, 0.5, 0.5, 0.7))
        yield _name(index, reference)
    if len(state.path) > 1:
        ground = state.projection[2]
        points = [np.array((x, y, ground)) for x, y, _ in state.path]
        yield _lines("path", 0, points, width=0.015, color=(0.6, 0.2, 0.8, 1.0))


def _marker(name: str, number: int, kind: int, scale: tuple[float, float, float], color: Iterable[float]) -> Marker:
    made = Marker(ns=name, id=number, type=kind, scale=Vector3(*scale), color=ColorRGBA(*color))
    made.pose.orientation.w = 1.0
    return made


def _ball(name: str, number: int, position: np.ndarray, size: float, color: Iterable[float]) -> Marker:
    made = _marker(name, number, Marker.SPHERE, scale=(size, size, size), color=color)
    made.pose.position = _point(position)
    return made


def _lines(name: str, number: int, points: Iterable[np.ndarray], width: float, color: Iterable[float]) -> Marker:
    made = _marker(name, number, Marker.LINE_STRIP, scale=(width, 0.0, 0.0), color=color)
    made.points = [_point(each) for each in points]
    return made


def _arrow(number: int, force: ContactForce) -> Marker:
    made = _marker("forces", number, Marker.ARROW, scale=(0.02, 0.04, 0.06), color=(0.9, 0.3, 0.1, 1.0))
    made.points = [_point(force.position), _point(force.position + FORCE_SCALE * force.force)]
    return made


def _cone(number: int, force: ContactForce, friction: float) -> Marker:
    """Make a cone as high as the vertical force is long: what friction holds has its tip in the base of the cone."""
    height = max(FORCE_SCALE * float(force.force[2]), 0.05)
    made = _marker("cones", number, Marker.TRIANGLE_LIST, scale=(1.0, 1.0, 1.0), color=(0.9, 0.6, 0.1, 0.25))
    sides = 24
    angles = [math.tau * each / sides for each in range(sides + 1)]
    radius = friction * height
    rim = [force.position + (radius * math.cos(angle), radius * math.sin(angle), height) for angle in angles]
    apex = _point(force.position)
    made.points = [each for a, b in zip(rim, rim[1:], strict=False) for each in (apex, _point(a), _point(b))]
    return made


def _frame(number: int, reference: ShownReference) -> Marker:
    """Make the axes of a reference; of a position they are those of the frame that it is in."""
    made = _marker("references", number, Marker.LINE_LIST, scale=(0.01, 0.0, 0.0), color=MEASURED_COLOR)
    position = reference.reference.position
    rotation = reference.reference.rotation
    colors = ((0.9, 0.1, 0.1, 1.0), (0.1, 0.8, 0.1, 1.0), (0.1, 0.2, 0.9, 1.0))
    for axis, color in zip(rotation.T, colors, strict=True):
        made.points += [_point(position), _point(position + AXES_LENGTH * axis)]
        made.colors += [ColorRGBA(*color)] * 2
    return made


def _name(number: int, reference: ShownReference) -> Marker:
    made = _marker("names", number, Marker.TEXT_VIEW_FACING, scale=(0.0, 0.0, 0.05), color=MEASURED_COLOR)
    made.text = f"{reference.module}/{reference.task}"
    made.pose.position = _point(reference.reference.position + (0.0, 0.0, AXES_LENGTH))
    return made


def _point(position: np.ndarray) -> Point:
    return Point(*position.tolist())


def _packed(message: genpy.Message) -> PackedMessage:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return PackedMessage(buffer.getvalue(), None)

"""Where one frame is in another, by the transforms that nodes publish."""

import math

import rospy
import tf2_ros

from solfer.interfaces.geometry import bare_frame
from solfer.middleware.ros.middleware import RosMiddleware
from solfer.middleware.ros.tf import prefixed, tf_prefix


class TransformTree:
    """Locates frames in a fixed one, such as `map`, by tf: a `solfer_tools.navigation.Localisation`.

    Args:
        fixed: The fixed frame.
        middleware: Its clock, and the parameter `tf_prefix` of the robot's own frames; it has to be there first.
    """

    STALE_AGE = 5.0
    """Age from which on a transform does not count [s]; one that is static has no age."""

    def __init__(self, fixed: str, middleware: RosMiddleware):
        self._fixed = bare_frame(fixed)
        self._prefix = tf_prefix(middleware)
        self._middleware = middleware
        self._rewinds = middleware.rewinds
        self._buffer = tf2_ros.Buffer(rospy.Duration(self.STALE_AGE), debug=False)
        self._listener = tf2_ros.TransformListener(self._buffer, tcp_nodelay=True)

    def locate(self, frame: str) -> tuple[float, float, float] | str:
        """Return place x, y [m] and heading [rad] of a frame in the fixed one, or what is missing."""
        if self._middleware.rewinds != self._rewinds:  # all that comes would pass for old
            self._rewinds = self._middleware.rewinds
            self._buffer.clear()
        frame = prefixed(self._prefix, bare_frame(frame))
        missing = f"a transform from '{self._fixed}' to '{frame}' on /tf"
        try:
            found = self._buffer.lookup_transform(self._fixed, frame, rospy.Time(0))
        except tf2_ros.TransformException:
            return missing
        stamp = found.header.stamp.to_sec()
        if stamp and self._middleware.stamp_time() - stamp > self.STALE_AGE:
            return missing
        place = found.transform.translation
        q = found.transform.rotation
        heading = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
        if not math.isfinite(place.x + place.y + heading):
            return f"finite numbers from '{self._fixed}' to '{frame}' on /tf"
        return place.x, place.y, heading

"""Waypoints on `cmd_vel`."""

from solfer.numerics.planar_move import seen_from
from solfer.transport import Middleware
from solfer_tools.navigation.course import CORRECTION_TIME, Course, Localisation, MeasuredPose, twist
from solfer_tools.navigation.waypoints import WaypointFollower


class WaypointCourse(Course):
    """Follows waypoints with velocities seen from the heading of the base.

    It ends where the base has come to rest at the last one: a base that lags behind its velocities, as just after its
    start, rolls on and is sent back. In a map it stays until the corrections of the localisation have been followed.

    Args:
        middleware: Carries all of it.
        follower: The law.
        target: Namespace of `cmd_vel`.
        odometry: Topic of the odometry.
        localisation: Where its frame is in that of the waypoints; None: they are the same.
    """

    def __init__(
        self,
        middleware: Middleware,
        follower: WaypointFollower,
        target: str,
        odometry: str,
        localisation: Localisation | None = None,
    ):
        self._follower = follower
        self._pose = MeasuredPose(middleware, odometry, localisation)
        self._settles = 0.0 if localisation is None else CORRECTION_TIME
        self._rested = 0.0
        self._twist = middleware.writer(f"{target}/cmd_vel" if target else "cmd_vel", "geometry_msgs/Twist")
        self.writers = (self._twist,)
        self.count = len(follower.waypoints)

    def awaits(self) -> str:
        """See `Course.awaits`; without odometry the base stops."""
        missing = self._pose.awaits()
        if missing:
            self._follower.stop()
        return missing

    def step(self, period: float, pace: float) -> bool:
        """See `Course.step`."""
        pose = self._pose
        follower = self._follower
        place = pose.x, pose.y, pose.heading
        moves = follower.step(place, period, pace)
        self._rested = 0.0 if moves else self._rested + period
        x, y, rate = follower.velocity
        self._twist.write(twist(*seen_from(pose.heading, x, y), rate))
        if moves:
            return True
        if self._rested >= self._settles and pose.still >= 0.3:
            return False
        follower.stay(place)
        return True

    def rest(self) -> None:
        """See `Course.rest`."""
        self._follower.stop()
        self._twist.write(twist(0.0, 0.0, 0.0))

    @property
    def number(self) -> int:
        """See `Course.number`."""
        return min(self._follower.index + 1, self.count)

    @property
    def name(self) -> str:
        """See `Course.name`."""
        return f"way-point {self._follower.waypoints[self.number - 1]}"

    @property
    def left(self) -> float:
        """See `Course.left`."""
        return self._follower.left

"""What happens in the demonstration of Fig. 5, as its topics report it."""

from solfer.transport import BodyMessage, JointMessage, Middleware
from solfer.transport.messages import PointsMessage
from solfer_tools.demo.record import ArrivalClock

RECORDED_TOPICS = {
    "measured": ("joint_states", "sensor_msgs/JointState", "joint states of the robot"),
    "base": ("floating_base", "nav_msgs/Odometry", "true base of a simulated robot"),
    "odometry": ("odometry/odom", "nav_msgs/Odometry", "estimate of the base"),
    "forces": ("ground_forces", "solfer/RobotPoints", "estimate of the ground's forces"),
    "arms": ("upper_body", "solfer/JointCommand", "manipulation"),
    "legs": ("lower_body", "solfer/JointCommand", "locomotion"),
}
"""Topics that are received: topic, message, and what it is for people."""


class DrivingRecorder:
    """Collects all messages of the topics; call `look` many times a second.

    Args:
        middleware: Middleware of the topics.

    Attributes:
        clock: Reads the time on the clock of recordings; stamps are of the wall clock, or of simulated time.
    """

    def __init__(self, middleware: Middleware):
        self.clock = ArrivalClock()
        self._now = middleware.now
        self._queues = {
            name: middleware.queue(topic, carries, 4000) for name, (topic, carries, _) in RECORDED_TOPICS.items()
        }
        self._messages: dict[str, list[JointMessage | BodyMessage | PointsMessage]] = {
            name: [] for name in RECORDED_TOPICS
        }

    def look(self) -> None:
        """Keep what has arrived."""
        for name, queue in self._queues.items():
            arrived = queue.drain()
            self._messages[name] += arrived
            if arrived and name == "measured":
                self.clock.note(arrived[-1].stamp, self._now())

    def missing(self) -> str:
        """Return what has not been received yet; empty: nothing."""
        for name, (topic, _, what) in RECORDED_TOPICS.items():
            if not self._messages[name]:
                return f"the {what}, on {topic}"
        return ""

    def newest(self, name: str) -> JointMessage | BodyMessage | PointsMessage | None:
        """Return the newest message of one of `RECORDED_TOPICS`; None before the first."""
        return self._messages[name][-1] if self._messages[name] else None

    def fastest_wheel(self, count: int) -> float:
        """Return the largest speed of a wheel in the newest `count` messages [rad/s]; 0 before the first one."""
        wheels = (
            abs(float(speed))
            for message in self._messages["measured"][-count:]
            if isinstance(message, JointMessage)
            for name, speed in zip(message.names, message.velocity, strict=True)
            if name.startswith("j_wheel_")
        )
        return max(wheels, default=0.0)

    def messages(self, name: str) -> list[JointMessage | BodyMessage | PointsMessage]:
        """Return all messages of one of `RECORDED_TOPICS`."""
        return self._messages[name]

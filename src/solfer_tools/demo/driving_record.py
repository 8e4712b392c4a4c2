"""What happens in the demonstration of Fig. 5, as its topics report it."""

from solfer.transport import Middleware
from solfer_tools.demo.record import TopicRecorder

RECORDED_TOPICS = {
    "measured": ("joint_states", "sensor_msgs/JointState", "joint states of the robot"),
    "base": ("floating_base", "nav_msgs/Odometry", "true base of a simulated robot"),
    "odometry": ("odometry/odom", "nav_msgs/Odometry", "estimate of the base"),
    "forces": ("ground_forces", "solfer/RobotPoints", "estimate of the ground's forces"),
    "arms": ("upper_body", "solfer/JointCommand", "manipulation"),
    "legs": ("lower_body", "solfer/JointCommand", "locomotion"),
}
"""Topics that are received: topic, message, and what it is for people."""


class DrivingRecorder(TopicRecorder):
    """Collects all messages of `RECORDED_TOPICS`.

    Args:
        middleware: Middleware of the topics.
    """

    def __init__(self, middleware: Middleware):
        super().__init__(middleware, {name: (topic, carries) for name, (topic, carries, _) in RECORDED_TOPICS.items()})

    def missing(self) -> str:
        """Return what has not been received yet; empty: nothing."""
        for name, (topic, _, what) in RECORDED_TOPICS.items():
            if not self.messages[name]:
                return f"the {what}, on {topic}"
        return ""

    def fastest_wheel(self, count: int) -> float:
        """Return the largest speed of a wheel in the newest `count` messages [rad/s]; 0 before the first one."""
        wheels = (
            abs(float(speed))
            for message in self.messages["measured"][-count:]
            for name, speed in zip(message.names, message.velocity, strict=True)
            if name.startswith("j_wheel_")
        )
        return max(wheels, default=0.0)

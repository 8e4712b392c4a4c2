"""Records measured and desired motion of the robot."""

from dataclasses import dataclass, field

import numpy as np

from solfer.transport import BodyMessage, JointMessage, Middleware


@dataclass
class Trace:
    """A series of messages of one topic, as arrays.

    Attributes:
        time: Stamps [s], shape (k,).
        names: Names of the columns.
        values: One array (k, len(names)) for each field.
    """

    time: np.ndarray
    names: tuple[str, ...]
    values: dict[str, np.ndarray] = field(default_factory=dict)

    def column(self, name: str, value: str) -> np.ndarray:
        """Return one column of one field, shape (k,)."""
        return self.values[value][:, self.names.index(name)]


class MotionRecorder:
    """Collects all messages of the robot's topics; call `collect` a few times a second.

    Args:
        middleware: Middleware of the topics.
    """

    def __init__(self, middleware: Middleware):
        self._queues = {
            "measured": middleware.queue("joint_states", "sensor_msgs/JointState", 4000),
            "desired": middleware.queue("position_controller/command", "solfer/JointCommand", 4000),
            "base": middleware.queue("floating_base", "nav_msgs/Odometry", 4000),
        }
        self._messages: dict[str, list[JointMessage | BodyMessage]] = {name: [] for name in self._queues}

    def collect(self) -> None:
        """Store the messages that have arrived."""
        for name, queue in self._queues.items():
            self._messages[name] += queue.drain()

    def newest(self, topic: str) -> JointMessage | BodyMessage | None:
        """Return the newest message of 'measured', 'desired' or 'base'; None before the first."""
        return self._messages[topic][-1] if self._messages[topic] else None

    def joints(self, topic: str) -> Trace:
        """Return positions and velocities of 'measured' or positions of 'desired'."""
        messages = self._messages[topic]
        names = messages[0].names
        values = {
            value: np.array([getattr(message, value) for message in messages])
            for value in ("position", "velocity")
            if getattr(messages[0], value) is not None
        }
        return Trace(np.array([message.stamp for message in messages]), names, values)

    def base(self) -> Trace:
        """Return positions [m] and yaw [rad] of the floating base, columns x y z yaw."""
        messages = self._messages["base"]
        rows = [(*message.position, _yaw(message.orientation)) for message in messages]
        return Trace(
            np.array([message.stamp for message in messages]), ("x", "y", "z", "yaw"), {"position": np.array(rows)}
        )


def _yaw(quaternion: np.ndarray) -> float:
    """Compute the heading of a Hamilton quaternion (x, y, z, w) [rad]."""
    x, y, z, w = quaternion
    return float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))

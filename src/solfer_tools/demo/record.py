"""Records measured and desired motion of the robot."""

from dataclasses import dataclass, field

import numpy as np

from solfer.transport import BodyMessage, JointMessage, Middleware


class ArrivalClock:
    """Reports when messages arrived, by stamps of a clock that may run more slowly, or have begun at another time."""

    def __init__(self) -> None:
        self._stamps: list[float] = []
        self._arrivals: list[float] = []

    def note(self, stamp: float, now: float) -> None:
        """Note the stamp of the newest message and the time of its arrival [s]; one that is not newer is left out."""
        if not self._stamps or stamp > self._stamps[-1]:
            self._stamps.append(stamp)
            self._arrivals.append(now)

    def times(self, stamps: np.ndarray) -> np.ndarray:
        """Return when messages arrived, or would have, by their stamps, shape (k,) [s]."""
        if not self._stamps:
            return np.array(stamps, float)
        known = np.array(self._stamps)
        arrivals = np.array(self._arrivals)
        delays = arrivals - known
        window = 0.5  # to both sides [s]: the fastest message in it takes a millisecond or two
        begins = np.searchsorted(arrivals, arrivals - window)
        ends = np.searchsorted(arrivals, arrivals + window)
        fastest = [delays[begin:end].min() for begin, end in zip(begins, ends, strict=True)]
        return stamps + np.interp(stamps, known, fastest)


@dataclass
class Trace:
    """A series of messages of one topic, as arrays.

    Attributes:
        time: When it was, on the clock of the middleware [s], shape (k,).
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
        self._clocks = {name: ArrivalClock() for name in self._queues}
        self._now = middleware.now

    def collect(self) -> None:
        """Store the messages that have arrived."""
        for name, queue in self._queues.items():
            arrived = queue.drain()
            self._messages[name] += arrived
            if arrived:
                self._clocks[name].note(arrived[-1].stamp, self._now())

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
        return Trace(self._times(topic), names, values)

    def base(self) -> Trace:
        """Return positions [m] and yaw [rad] of the floating base, columns x y z yaw."""
        messages = self._messages["base"]
        rows = [(*message.position, _yaw(message.orientation)) for message in messages]
        return Trace(self._times("base"), ("x", "y", "z", "yaw"), {"position": np.array(rows)})

    def _times(self, topic: str) -> np.ndarray:
        """Return the times of all messages on one clock: simulation and plugins of a real-time layer stamp by two."""
        return self._clocks[topic].times(np.array([message.stamp for message in self._messages[topic]]))


def _yaw(quaternion: np.ndarray) -> float:
    """Compute the heading of a Hamilton quaternion (x, y, z, w) [rad]."""
    x, y, z, w = quaternion
    return float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))

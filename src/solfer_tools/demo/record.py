"""Records measured and desired motion of the robot."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from solfer.transport import Middleware
from solfer_tools.navigation.course import heading_of


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


class TopicRecorder:
    """Collects all messages of topics; call `collect` many times a second.

    Args:
        middleware: Middleware of the topics.
        topics: Topic and message of each, by its name here.

    Attributes:
        messages: What has arrived, by name.
        clocks: Read the time on the clock of recordings; stamps are of the wall clock, or of simulated time.
    """

    def __init__(self, middleware: Middleware, topics: Mapping[str, tuple[str, str]]):
        self._queues = {name: middleware.queue(topic, carries, 4000) for name, (topic, carries) in topics.items()}
        self.messages: dict[str, list[Any]] = {name: [] for name in topics}
        self.clocks = {name: ArrivalClock() for name in topics}
        self._now = middleware.now

    def collect(self) -> None:
        """Store the messages that have arrived."""
        for name, queue in self._queues.items():
            arrived = queue.drain()
            self.messages[name] += arrived
            if arrived:
                self.clocks[name].note(arrived[-1].stamp, self._now())

    def newest(self, name: str) -> Any:
        """Return the newest message of a topic; None before the first."""
        return self.messages[name][-1] if self.messages[name] else None


class MotionRecorder(TopicRecorder):
    """Collects what the robot measures and is commanded.

    Args:
        middleware: Middleware of the topics.
    """

    def __init__(self, middleware: Middleware):
        topics = {
            "measured": ("joint_states", "sensor_msgs/JointState"),
            "desired": ("position_controller/command", "solfer/JointCommand"),
            "base": ("floating_base", "nav_msgs/Odometry"),
        }
        super().__init__(middleware, topics)

    def joints(self, topic: str) -> Trace:
        """Return positions and velocities of 'measured' or positions of 'desired'."""
        messages = self.messages[topic]
        names = messages[0].names
        values = {
            value: np.array([getattr(message, value) for message in messages])
            for value in ("position", "velocity")
            if getattr(messages[0], value) is not None
        }
        return Trace(self._times(topic), names, values)

    def base(self) -> Trace:
        """Return positions [m] and yaw [rad] of the floating base, columns x y z yaw."""
        rows = [(*message.position, heading_of(message.orientation)) for message in self.messages["base"]]
        return Trace(self._times("base"), ("x", "y", "z", "yaw"), {"position": np.array(rows)})

    def _times(self, topic: str) -> np.ndarray:
        """Return the times of all messages on one clock: simulation and plugins of a real-time layer stamp by two."""
        return self.clocks[topic].times(np.array([message.stamp for message in self.messages[topic]]))

"""How messages of joints and IMU arrive, and what faults of a transport are like it."""

import contextlib
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from solfer.errors import MiddlewareError
from solfer.middleware.ros import RosMiddleware, RosNode
from solfer.middleware.ros.node.launch import Launch, free_port

TOPICS = {"joint_states": "sensor_msgs/JointState", "imu": "sensor_msgs/Imu"}
NODES = {"simulation", "hands", "odometry", "full_compensation"}
"""Parts of Fig. 5 that report once all of it runs."""
SETTLE, PATIENCE = 5.0, 60.0
"""Time that nodes get to find each other, and to start [s]."""
CYCLE = 0.005
"""Period of a loop that receives both [s]."""


class Stream(NamedTuple):
    """Messages of a topic.

    Attributes:
        stamps: Times of their measurements, shape (n,) [s].
        arrivals: Times of their arrivals by another clock, in their order, shape (n,) [s].
    """

    stamps: np.ndarray
    arrivals: np.ndarray

    @property
    def period(self) -> float:
        """Time from a stamp to the next, as most have it [s]."""
        return float(np.median(np.diff(np.unique(self.stamps))))

    @property
    def loss(self) -> float:
        """Share of the messages that did not arrive, by the gaps between the stamps."""
        sent = round((self.stamps.max() - self.stamps.min()) / self.period) + 1
        return max(0.0, 1.0 - len(np.unique(self.stamps)) / sent)

    @property
    def delays(self) -> np.ndarray:
        """Delay of each message, less the smallest one from then on, shape (n,) [s].

        The smallest one grows where a simulation falls behind real time, which delays no message.
        """
        delays = self.arrivals - self.stamps
        return delays - np.minimum.accumulate(delays[::-1])[::-1]

    @property
    def behind(self) -> float:
        """Share of the time by which the stamps fell behind the arrivals."""
        return 1.0 - float((self.stamps[-1] - self.stamps[0]) / (self.arrivals[-1] - self.arrivals[0]))


def alone(first: Stream, second: Stream) -> float:
    """Return the share of cycles in which one of two streams is new alone, as the mean over the phases of a loop."""
    begin = max(first.arrivals[0], second.arrivals[0])
    end = min(first.arrivals[-1], second.arrivals[-1])
    shares = []
    for phase in np.arange(0.0, CYCLE, 0.1 * CYCLE):
        edges = np.arange(begin + phase, end, CYCLE)
        new = [np.histogram(each.arrivals, edges)[0] > 0 for each in (first, second)]
        shares.append(float(np.mean(new[0] != new[1])))
    return float(np.mean(shares))


def as_faults(streams: Mapping[str, Stream]) -> str:
    """Return a file of faults that are like streams, by their topics.

    The jitter is the one whose uniform delays have the 99th percentile of the worse stream.
    """
    lines, jitter, loss = [], 0.0, 0.0
    for topic, stream in streams.items():
        median, high, largest = (1e3 * np.percentile(stream.delays, share) for share in (50.0, 99.0, 100.0))
        lines.append(
            f"# {topic}: {1.0 / stream.period:.0f} Hz, {100.0 * stream.loss:.2f} % lost, delay above the smallest one: "
            f"median {median:.2f} ms, 99 % {high:.2f} ms, largest {largest:.2f} ms."
        )
        jitter, loss = max(jitter, 1e-3 * high / 0.99), max(loss, stream.loss)
    behind = 100.0 * max(stream.behind for stream in streams.values())
    lines.append(f"# Their clock fell behind that of the arrivals by {behind:.1f} % of the time, which is no delay.")
    share = 100.0 * alone(*streams.values())
    lines.append(f"# In {share:.1f} % of the cycles of a loop at 200 Hz one of them is new alone.")
    values = f"jitter: {jitter:.4f}" + f", loss: {loss:.4f}" * (loss > 0.0)
    return "\n".join((*lines, "seed: 1", "topics:", f'  "*": {{{values}}}'))


def receive(middleware: RosMiddleware, seconds: float) -> dict[str, Stream]:
    """Receive joints and IMU for a time [s]."""
    readers = {topic: middleware.reader(topic, message, 1000) for topic, message in TOPICS.items()}
    received: dict[str, list[tuple[float, float]]] = {topic: [] for topic in TOPICS}
    begin = time.monotonic() + 1.0  # until they are connected
    while (now := time.monotonic()) < begin + seconds and middleware.running():
        for topic, reader in readers.items():
            while reader.read_next() is not None:
                if now >= begin:
                    received[topic].append((reader.message.stamp, reader.arrival))
        time.sleep(CYCLE)
    return {topic: Stream(*np.array(pairs).T) for topic, pairs in received.items()}


def arrivals_under_ros(seconds: float) -> str:
    """Start Fig. 5 on a master of its own, and measure it for a time [s]; return a file of faults that are like it.

    Raises:
        MiddlewareError: It does not start.
    """
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "launch.log")
        with Launch(["solfer", "figure_5.launch"], log, free_port()) as system:
            system.wait_for_master(60.0)
            with contextlib.closing(RosMiddleware(RosNode("arrivals", ["arrivals"]))) as middleware:
                end = time.monotonic() + PATIENCE
                while missing := NODES - middleware.reports().keys():
                    system.check()
                    if not middleware.running() or time.monotonic() > end:
                        raise MiddlewareError(
                            f"no report of {', '.join(sorted(missing))} within {PATIENCE:g} s",
                            expected=f"one beside {', '.join(sorted(middleware.reports()))}",
                        )
                    time.sleep(0.1)
                time.sleep(SETTLE)
                return as_faults(receive(middleware, seconds))

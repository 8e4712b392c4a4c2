"""The clock of a node: the machine's, or, where the parameter /use_sim_time is true, that of a simulation.

The node that simulates publishes the time on /clock and uses the machine's clock itself; all others receive it. rospy's
own subscription of /clock is not used: Nagle's algorithm, which it leaves on, delays the time by up to 40 ms.
"""

import threading
import time
from collections.abc import Callable

import genpy
import rospy
from rosgraph_msgs.msg import Clock as ClockMessage
from rospy.rostime import _set_rostime as set_ros_time

from solfer.errors import MiddlewareError
from solfer.middleware.ros.codecs.packed_message import TIME, PackedMessage
from solfer.middleware.ros.node.master import refuse_second
from solfer.middleware.ros.topic_publisher import TopicPublisher
from solfer.transport.waiting import wait_for

POLL_PERIOD = 0.1
"""Time between two checks for a requested end, while simulated time stands still [s]."""


def ros_time(seconds: float) -> genpy.Time:
    """Round to the nearest nanosecond; `genpy.Time.from_sec` cuts off, and 0.3 becomes 0.299999999."""
    return genpy.Time(0, round(seconds * 1e9))


class RosClock:
    """The machine's monotonic clock; ROS time is the wall clock's.

    Args:
        running: False as soon as the end was requested.

    Attributes:
        rewinds: How often the time that it follows has gone back.
    """

    rewinds: int = 0

    def __init__(self, running: Callable[[], bool]):
        self._running = running

    def now(self) -> float:
        """See `Middleware.now`."""
        return time.monotonic()

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`."""
        left = deadline - time.monotonic()
        if left > 0.0:
            time.sleep(left)

    def publish(self, simulated: float) -> None:
        """See `Middleware.publish_time`; no effect here."""


class PublishingClock(RosClock):
    """Publishes the simulated time; ROS time in this process is the simulated time.

    The first time is published at once, so that nodes that start meanwhile do not wait in vain.

    Raises:
        MiddlewareError: Another node publishes the time.
    """

    RATE = 500.0
    """Times published for each simulated second [Hz]."""

    def __init__(self, running: Callable[[], bool]):
        super().__init__(running)
        self._topic_publisher = TopicPublisher("/clock", ClockMessage, latch=True)
        refuse_second("/clock", rospy.get_name())
        self._published = 0.0
        self._send(0.0)

    def publish(self, simulated: float) -> None:
        """Publish the simulated time [s]: `RATE` times in a simulated second, and when it goes back."""
        if simulated < self._published or simulated - self._published >= 1.0 / self.RATE - 1e-9:
            self._send(simulated)
        else:
            set_ros_time(ros_time(simulated))

    def _send(self, simulated: float) -> None:
        self._published = simulated
        stamp = ros_time(simulated)
        set_ros_time(stamp)
        self._topic_publisher.latch(ClockMessage(stamp))
        self._topic_publisher.send(PackedMessage(TIME.pack(stamp.secs, stamp.nsecs), name=None))


class SubscribingClock(RosClock):
    """Follows /clock: `now` is the simulated time that has passed. It never goes back, even if the simulation does.

    Raises:
        MiddlewareError: No node publishes the time.
    """

    def __init__(self, running: Callable[[], bool]):
        super().__init__(running)
        self._passed = 0.0
        self._newest = None
        self._moved = threading.Condition()
        set_ros_time(genpy.Time())
        rospy.Subscriber("/clock", ClockMessage, self._receive, queue_size=1, tcp_nodelay=True)
        timeout = 20.0  # [s]: a simulator that starts beside this node needs up to 10 s
        if not wait_for(lambda: self._newest is not None, timeout, running):
            raise MiddlewareError(
                "use_sim_time is true but nothing publishes /clock",
                expected="a simulator that runs, or rosparam set /use_sim_time false",
            )

    def now(self) -> float:
        """See `Middleware.now`."""
        return self._passed

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`; returns as well when the end was requested."""
        with self._moved:
            while self._passed < deadline - 1e-9 and self._running():
                self._moved.wait(POLL_PERIOD)

    def _receive(self, message: ClockMessage) -> None:
        published = message.clock
        set_ros_time(published)
        with self._moved:
            if self._newest is not None and published > self._newest:
                self._passed += (published - self._newest).to_sec()
            elif self._newest is not None and published < self._newest:
                self.rewinds += 1
            self._newest = published
            self._moved.notify_all()


def make_clock(running: Callable[[], bool], publishes: bool) -> RosClock:
    """Make the clock of a node that has started.

    Args:
        running: False as soon as the end was requested.
        publishes: Whether the node simulates.

    Raises:
        MiddlewareError: The node has to follow /clock, and no node publishes the time; or it simulates, and another
            node publishes the time.
        ShutdownRequested: The node has to end meanwhile.
    """
    if not rospy.get_param("/use_sim_time", False):
        return RosClock(running)
    return PublishingClock(running) if publishes else SubscribingClock(running)

"""The clock of a node: the machine's, or, where the parameter /use_sim_time is true, that of a simulation.

The node that simulates tells the time on /clock and goes by the machine's clock itself; all others hear it. rospy's
own subscription of /clock is not used: Nagle's algorithm, which it leaves on, holds the time back by up to 40 ms.
"""

import threading
import time
from collections.abc import Callable

import genpy
import rospy
from rosgraph_msgs.msg import Clock as ClockMessage
from rospy.rostime import _set_rostime as set_ros_time

from solfer.errors import MiddlewareError
from solfer.middleware.ros.frame import TIME, Frame
from solfer.middleware.ros.outlet import Outlet
from solfer.middleware.ros.waiting import wait_for

PATIENCE = 5.0
"""Longest wait for the first time on /clock [s]."""

LOOK = 0.1
"""Time between two looks whether somebody asked for the end, while simulated time stands still [s]."""

RATE = 500.0
"""Times told for each simulated second [Hz]."""


def ros_time(seconds: float) -> genpy.Time:
    """Time to the nearest nanosecond; `genpy.Time.from_sec` cuts off, and 0.3 becomes 0.299999999."""
    return genpy.Time(0, round(seconds * 1e9))


class Clock:
    """The machine's monotonic clock; ROS time is the wall clock's.

    Args:
        running: False as soon as somebody asked for the end.

    Attributes:
        rewinds: How often the time that it goes by has gone back.
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

    def tell(self, simulated: float) -> None:
        """See `Middleware.tell_time`; nobody goes by it here."""


class ToldClock(Clock):
    """Tells the simulated time to everybody else; ROS time in this process is the simulated time.

    The first time is told at once, so that nodes that start meanwhile do not wait in vain.
    """

    def __init__(self, running: Callable[[], bool]):
        super().__init__(running)
        self._outlet = Outlet("/clock", ClockMessage, latch=True)
        self._told = 0.0
        self._send(0.0)

    def tell(self, simulated: float) -> None:
        """Tell the simulated time [s]: RATE times in a simulated second, and when it goes back."""
        if simulated < self._told or simulated - self._told >= 1.0 / RATE - 1e-9:
            self._send(simulated)
        else:
            set_ros_time(ros_time(simulated))

    def _send(self, simulated: float) -> None:
        self._told = simulated
        stamp = ros_time(simulated)
        set_ros_time(stamp)
        self._outlet.latch(ClockMessage(stamp))
        self._outlet.send(Frame(TIME.pack(stamp.secs, stamp.nsecs), name=None))


class HeardClock(Clock):
    """Goes by /clock: `now` is the simulated time that has passed. It never goes back, also when the simulation does.

    Raises:
        MiddlewareError: Nobody tells the time.
    """

    def __init__(self, running: Callable[[], bool]):
        super().__init__(running)
        self._passed, self._newest = 0.0, None
        self._moved = threading.Condition()
        set_ros_time(genpy.Time())
        rospy.Subscriber("/clock", ClockMessage, self._take, queue_size=1, tcp_nodelay=True)
        if not wait_for(lambda: self._newest is not None, PATIENCE, running):
            raise MiddlewareError(
                "use_sim_time is true but nothing publishes /clock",
                expected="a simulator that runs, or rosparam set /use_sim_time false",
            )

    def now(self) -> float:
        """See `Middleware.now`."""
        return self._passed

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`; returns as well when somebody asked for the end."""
        with self._moved:
            while self._passed < deadline - 1e-9 and self._running():
                self._moved.wait(LOOK)

    def _take(self, message: ClockMessage) -> None:
        told = message.clock
        set_ros_time(told)
        with self._moved:
            if self._newest is not None and told > self._newest:
                self._passed += (told - self._newest).to_sec()
            elif self._newest is not None and told < self._newest:
                self.rewinds += 1
            self._newest = told
            self._moved.notify_all()


def make_clock(running: Callable[[], bool], tells: bool) -> Clock:
    """The clock of a node that has started.

    Args:
        running: False as soon as somebody asked for the end.
        tells: Whether the node simulates.

    Raises:
        MiddlewareError: The node has to go by /clock, and nobody tells the time.
        Ended: The node was asked to end meanwhile.
    """
    if not rospy.get_param("/use_sim_time", False):
        return Clock(running)
    return ToldClock(running) if tells else HeardClock(running)

"""The node of a process under ROS 2: its name, its clock, its services' threads, and its end."""

import logging
import os
import struct
import sys
import threading
import time
from argparse import ArgumentTypeError
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from rosgraph_msgs.msg import Clock as ClockMessage

from solfer.errors import ConfigError, MiddlewareError
from solfer.middleware.ros2.endpoints import Polled, ignore
from solfer.middleware.ros2.quality import quality
from solfer.process import ProcessEnd, run_process
from solfer.transport.lockstep.client import follower_names
from solfer.transport.lockstep.step_clock import StepClock

logger = logging.getLogger(__name__)

POLL_PERIOD = 0.1
"""Time between two checks for a requested end, while simulated time stands still [s]."""


ONE_SUBSCRIPTION = (1, 0, 0, 0, 0, 0)
"""What a wait is for: subscriptions, guard conditions, timers, clients, services, events."""


def arguments(argv: Sequence[str]) -> list[str]:
    """Return the command line without the program's name, and without `--ros-args` and what belongs to it."""
    return remove_ros_args(list(argv))[1:]


def argument(argv: Sequence[str], name: str) -> str | None:
    """Return the value of `name:=value`, such as in `--ros-args -p name:=value`; None: there is none."""
    return next((each.partition(":=")[2] for each in argv if each.startswith(f"{name}:=")), None)


def setting(argv: Sequence[str], name: str, default: Any, kind: Callable[[str], Any] = str) -> Any:
    """Return the value of a setting, see `argument`; `kind` converts its text, and raises ValueError for other texts.

    Raises:
        ConfigError: The text is not a value of that kind.
    """
    value = argument(argv, name)
    if not value:
        return default
    try:
        return kind(value)
    except (ValueError, ArgumentTypeError) as error:
        raise ConfigError(f"'{value}' is not a value of '{name}'", where=f"{name}:=", expected=str(error)) from error


def run_main(main: Callable[[list[str]], int]) -> None:
    """Run a node's `main` on the process' arguments and exit with its code; an error is printed in one block."""
    run_process(main, sys.argv)


class Ros2Clock:
    """The machine's monotonic clock; ROS time is the wall clock's.

    Attributes:
        rewinds: How often the time that it follows has gone back.
        epoch: ROS time at which the clock of what this process measures was zero [s]; None: there is no such clock.
    """

    rewinds: int = 0
    epoch: float | None = None

    def now(self) -> float:
        """See `Middleware.now`."""
        return time.monotonic()

    def stamp_of(self, measured: float) -> int:
        """Return the stamp of what was measured at a time of this process [ns], or the present if that is unknown."""
        if self.epoch is None or measured <= 0.0:
            return self.present()
        return round(1e9 * (self.epoch + measured))

    def present(self) -> int:
        """Return ROS time [ns]."""
        return time.time_ns()

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`."""
        left = deadline - time.monotonic()
        if left > 0.0:
            time.sleep(left)

    def publish(self, simulated: float) -> None:
        """See `Middleware.publish_time`; no effect here."""


class Ros2PublishingClock(Ros2Clock):
    """Publishes the simulated time on /clock; ROS time in this process is the simulated time.

    Args:
        node: The node that simulates.
    """

    RATE = 500.0
    """Times published for each simulated second [Hz]."""

    def __init__(self, node: Node):
        self._publisher = node.create_publisher(ClockMessage, "/clock", quality(1, reliable=False))
        self._message = ClockMessage()
        self._published = self._simulated = 0.0

    def present(self) -> int:
        """Return ROS time [ns]."""
        return round(1e9 * self._simulated)

    def publish(self, simulated: float) -> None:
        """Publish the simulated time [s]: `RATE` times in a simulated second, and when it goes back."""
        self._simulated = simulated
        if simulated < self._published or simulated - self._published >= 1.0 / self.RATE - 1e-9:
            self._published = simulated
            stamp = self._message.clock
            stamp.sec, stamp.nanosec = divmod(self.present(), 1_000_000_000)
            self._publisher.publish(self._message)


class Ros2SubscribingClock(Ros2Clock):
    """Follows /clock; it stands still with it, and never goes back.

    Each call takes the times that have come: a callback of an executor would cost more than a cycle.

    Args:
        node: The node.
        running: False as soon as the end was requested.

    Raises:
        MiddlewareError: No node publishes the time.
    """

    FIRST_TIME = 10.0
    """Longest wait for the first time [s]."""

    DEPTH = 64
    """Times that wait for the next call: a lost one could be that which went back."""

    STAMP = struct.Struct("<4xiI")
    """A packed rosgraph_msgs/Clock: seconds and nanoseconds behind the four bytes that begin each message."""

    def __init__(self, node: Node, running: Callable[[], bool]):
        self._running = running
        self._lock = threading.Lock()
        self._context = node.context
        self._waits = threading.local()
        self._passed = 0.0
        self._newest: int | None = None
        self._subscription = node.create_subscription(
            ClockMessage, "/clock", ignore, quality(self.DEPTH, reliable=False), callback_group=Polled(), raw=True
        )
        self._handle = self._subscription.handle
        end = time.monotonic() + self.FIRST_TIME
        while self._take() is None and running() and time.monotonic() < end:
            self._wait()
        if self._newest is None and running():
            raise MiddlewareError(
                "use_sim_time is true, and no node publishes the time on /clock",
                expected="a simulator that runs, or a node without `-p use_sim_time:=true`",
            )

    def now(self) -> float:
        """See `Middleware.now`."""
        self._take()
        return self._passed

    def present(self) -> int:
        """Return ROS time [ns]."""
        return self._take() or 0

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`; returns as well when the end was requested."""
        while self.now() < deadline - 1e-9 and self._running():
            self._wait()

    def _take(self) -> int | None:
        """Take the times that have come, and return the newest [ns]; None before the first."""
        with self._lock:
            while (taken := self._handle.take_message(ClockMessage, True)) is not None:
                seconds, nanoseconds = self.STAMP.unpack(taken[0])
                self._receive(seconds * 1_000_000_000 + nanoseconds)
            return self._newest

    def _receive(self, published: int) -> None:
        if self._newest is not None and published > self._newest:
            self._passed += 1e-9 * (published - self._newest)
        elif self._newest is not None and published < self._newest:
            self.rewinds += 1
        self._newest = published

    def _wait(self) -> None:
        """Wait for a time that comes, at most `POLL_PERIOD`."""
        waits = getattr(self._waits, "set", None)
        if waits is None:
            waits = self._waits.set = rclpy_implementation.WaitSet(*ONE_SUBSCRIPTION, self._context.handle)
        waits.clear_entities()
        waits.add_subscription(self._handle)
        waits.wait(round(1e9 * POLL_PERIOD))


class Ros2StepClock(StepClock, Ros2Clock):
    """Stands still between two cycles of a lock-step; ROS time is that of the cycle.

    Args:
        running: False as soon as the end was requested.
    """

    def __init__(self, running: Callable[[], bool]):
        super().__init__(running, self._set_present)
        self._present = 0

    def present(self) -> int:
        """Return ROS time [ns]."""
        return self._present

    def _set_present(self, simulated: float) -> None:
        self._present = round(1e9 * simulated)


class Ros2Node:
    """A started node with a context of its own, so that a process may have several.

    Ctrl-C, SIGTERM and a closed terminal ask the loop to end, so that it can bring the robot to rest while its topics
    are still open. An executor in a thread carries out services, replies and parameters; topics are read without it.

    Args:
        name: Name of the node, unless the arguments have `-r __node:=`.
        argv: Arguments with `--ros-args`; by default those of the process.
        publishes_time: Whether the node simulates, and publishes the time for all others if use_sim_time is true.

    Attributes:
        name: Resolved name.
        ros: The node of rclpy.
        clock: Clock of the node.
        followers: Nodes in lock-step with the simulation, by the parameter `lockstep`; of ROS 2 each node has its own.

    Raises:
        ConfigError: The name or the arguments are wrong.
        MiddlewareError: No node publishes the time that this one has to follow.
    """

    THREADS = 8
    """Requests that wait for the loop at the same time; further ones wait in the middleware."""

    def __init__(self, name: str, argv: Sequence[str] | None = None, publishes_time: bool = False):
        os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        self._context = Context()
        try:
            rclpy.init(
                args=list(sys.argv if argv is None else argv),
                context=self._context,
                signal_handler_options=SignalHandlerOptions.NO,
            )
            self.ros = Node(name, context=self._context, automatically_declare_parameters_from_overrides=True)
        except Exception as error:  # rclpy has one class for each mistake in an argument
            self._context.try_shutdown()
            raise ConfigError(
                f"node '{name}' cannot start: {error}", expected="a name and arguments of ROS 2"
            ) from error
        self.name = self.ros.get_fully_qualified_name()
        self._ends = threading.Event()
        main = threading.current_thread() is threading.main_thread()
        self._end = ProcessEnd(self._ends.set) if main else None
        follows = self.ros.get_parameter("use_sim_time").value
        if follows:  # rclpy's own subscription of /clock would cost a second callback for each time
            self.ros.set_parameters([Parameter("use_sim_time", value=False)])
        self._executor = MultiThreadedExecutor(self.THREADS, context=self._context)
        self._executor.add_node(self.ros)
        self._thread = threading.Thread(target=self._spin, name="ros2", daemon=True)
        self._thread.start()
        try:
            self.clock: Ros2Clock
            self.followers = follower_names(
                self.ros.get_parameter_or("lockstep", Parameter("lockstep", value="")).value,
                resolve=lambda each: f"/{each.lstrip('/')}",
                where="parameter lockstep",
            )
            if self.name in self.followers:
                self.clock = Ros2StepClock(self.running)
            elif not follows:
                self.clock = Ros2Clock()
            elif publishes_time:
                self.clock = Ros2PublishingClock(self.ros)
            else:
                self.clock = Ros2SubscribingClock(self.ros, self.running)
        except BaseException:
            self.close()
            raise

    def running(self) -> bool:
        """Return whether the end was not requested yet."""
        return not self._ends.is_set() and (self._end is None or self._end.running())

    def close(self) -> None:
        """End the node."""
        self._ends.set()
        self._executor.shutdown(timeout_sec=1.0)
        self.ros.destroy_node()
        self._context.try_shutdown()
        self._thread.join(1.0)
        if self._end is not None:
            self._end.close()

    def _spin(self) -> None:
        while True:
            try:
                self._executor.spin()
            except ExternalShutdownException:
                pass
            except InvalidHandle:  # a thread destroyed an endpoint while this one looked at it
                continue
            return

"""What the rostests share: the robot's messages, requests to the plugin, and processes; every wait has a bound."""

import contextlib
import functools
import os
import signal
import subprocess
import sys
import time
import unittest
import xmlrpc.client
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import rosgraph
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState

from solfer.msg import JointCommand
from solfer.srv import GetJointNames, MoveJoints, MoveJointsResponse

START = 60.0
"""Longest time until a node that was started is ready, and the bound of every wait, on a busy machine [s]."""

LATE = 20.0
"""Longest delay behind the time that a reply promises, on a busy machine [s]."""

PERIOD = 0.005
"""Simulated time between two joint states [s]."""

SERVICE = "/joint_states/trajectory"
STANDS_STILL = 0.003
"""Largest motion of a joint that holds its position [rad]."""

UNLOADED, LOADED = 0.02, 0.04
"""How far from its goal a joint may end [rad]. A leg's springs give way to the weight: 130 Nm / 5000 Nm/rad = 0.026."""

LEGS = ("hip_", "knee_", "ankle_")

NODES = Path(os.path.realpath(__file__)).parents[2] / "nodes"
CENTAURO = NODES.parent / "config" / "centauro.yaml"

SOAKS = "SOAK" in os.environ
"""Whether it is a soak, which runs all tests of a launch."""

soak = unittest.skipUnless(SOAKS, "takes long: test_whole_rostest in test_rostests.py runs it")
"""Leaves a test to the soak, which runs each launch as a whole."""


def wait_for(condition: Callable[[], bool], timeout: float, what: str | Callable[[], str]) -> None:
    """Wait until `condition` holds; fails after `timeout` [s] with `what` was missing."""
    end = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"not within {timeout:g} s: {what if isinstance(what, str) else what()}")
        time.sleep(0.01)


def program(name: str, *arguments: str) -> tuple[str, ...]:
    """Make the command of one of our nodes; `rosrun` would search the package for it each time."""
    return sys.executable, str(NODES / name), *arguments


def subscribers(topic: str, publisher: str = "/simulator") -> set[str]:
    """Return the names of the nodes that are connected to a publisher of a topic."""
    uri = rosgraph.Master(rospy.get_name()).lookupNode(publisher)
    connections = xmlrpc.client.ServerProxy(uri).getBusInfo(rospy.get_name())[2]
    return {node for _, node, direction, _, name, *_ in connections if (direction, name) == ("o", topic)}


def numbers(message: object) -> np.ndarray:
    """Convert a vector or quaternion message to an array."""
    return np.array([getattr(message, name) for name in message.__slots__])


class Robot:
    """The messages and commands of the simulated robot.

    Attributes:
        odometry: Messages of the floating base, oldest first.
        wheel_command: The last command to the wheels.
    """

    def __init__(self) -> None:
        self._joints = JointState()
        self.odometry: list[Odometry] = []
        self.wheel_command = JointCommand()
        rospy.Subscriber("/joint_states", JointState, self._receive_joints, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("/floating_base", Odometry, self.odometry.append, queue_size=100, tcp_nodelay=True)
        rospy.Subscriber("/velocity_controller/command", JointCommand, self._receive_command, queue_size=1)
        wait_for(lambda: bool(self._joints.name), START, "joint states")
        rospy.wait_for_service("/velocity_controller/get_joint_names", START)
        self.wheels = rospy.ServiceProxy("/velocity_controller/get_joint_names", GetJointNames)().names

    def positions(self) -> dict[str, float]:
        """Measured positions of the joints that hold one, by name [rad]."""
        message = self._joints
        measured = dict(zip(message.name, message.position, strict=True))
        return {name: value for name, value in measured.items() if name not in self.wheels}

    def speeds(self) -> list[float]:
        """Measured speeds of the wheels [rad/s]."""
        message = self._joints
        measured = dict(zip(message.name, message.velocity, strict=True))
        return [measured[name] for name in self.wheels]

    def moved(self, before: dict[str, float]) -> float:
        """Compute the largest distance of a joint from where it was [rad]."""
        now = self.positions()
        return max(abs(now[name] - value) for name, value in before.items())

    def arrive(self, goal: dict[str, float], timeout: float) -> None:
        """Wait until all joints of `goal` are there; those of the legs give way to the weight."""

        def away() -> list[str]:
            now = self.positions()
            return [
                f"{name} at {now[name]:.4f} instead of {value:.4f}"
                for name, value in goal.items()
                if abs(now[name] - value) > (LOADED if name.startswith(LEGS) else UNLOADED)
            ]

        wait_for(lambda: not away(), timeout, lambda: f"joints at their goals: {', '.join(away())}")

    def reach(self, goal: dict[str, float], speed: float = 0.5, process: subprocess.Popen | None = None) -> None:
        """Have the joints of `goal` moved there [rad, rad/s]; a `process` that ends is not waited for."""
        move(
            functools.partial(self.arrive, goal),
            functools.partial(insist, process),
            joints=list(goal),
            positions=list(goal.values()),
            speed=speed,
        )

    def passes(self, duration: float) -> None:
        """Wait until `duration` [s] of simulated time has passed, which on a busy machine takes longer."""
        end = self._joints.header.seq + duration / PERIOD
        wait_for(lambda: self._joints.header.seq >= end, START, f"{duration:g} s of the simulation")

    def settle(self, timeout: float = START) -> None:
        """Wait until no joint moves any more."""

        def stands() -> bool:
            before = self.positions()
            self.passes(0.3)
            return self.moved(before) < STANDS_STILL / 6.0

        wait_for(stands, timeout, "a robot that stands still")

    def turn_wheels(self, speed: float) -> None:
        """Turn all wheels, and wait until they do [rad/s]."""

        def turn(timeout: float) -> None:
            wait_for(
                lambda: max(abs(each - speed) for each in self.speeds()) < 0.05, timeout, f"wheels at {speed:g} rad/s"
            )

        move(turn, joints=self.wheels, velocities=[speed] * len(self.wheels))

    def _receive_joints(self, message: JointState) -> None:
        self._joints = message

    def _receive_command(self, message: JointCommand) -> None:
        self.wheel_command = message


def ask(**request: object) -> MoveJointsResponse:
    """Ask the plugin for a motion."""
    return rospy.ServiceProxy(SERVICE, MoveJoints)(**request)


def insist(process: subprocess.Popen | None = None, **request: object) -> MoveJointsResponse:
    """Ask the plugin for a motion until it accepts; a `process` that ends is not waited for.

    A plugin that has just been started, or that holds because its feedback is late, does not accept at once.
    """
    answer, reply = "no such service", None

    def accepts() -> bool:
        nonlocal answer, reply
        if process is not None and process.poll() is not None:
            raise AssertionError(f"the plugin has ended with code {process.returncode}: {process.stdout.read()}")
        try:
            reply = ask(**request)
        except rospy.ServiceException as error:  # it is not offered yet
            answer = str(error)
            time.sleep(0.1)
            return False
        answer = reply.message
        return reply.success

    wait_for(accepts, START, lambda: f"a plugin that accepts requests: {answer}")
    return reply


def move(
    arrive: Callable[[float], None], asks: Callable[..., MoveJointsResponse] = insist, **request: object
) -> MoveJointsResponse:
    """Request a motion, and wait for its end; returns the reply to the first request.

    A plugin with late feedback, as on a machine that stalls, gives its motion up and holds: then ask again.

    Args:
        arrive: Waits for the goal, for a time [s].
        asks: Calls the plugin.
        **request: Fields of the request.
    """
    first = reply = asks(**request)
    for left in (2, 1, 0):
        assert reply.success, reply.message
        try:
            arrive(reply.duration + LATE)
            break
        except AssertionError:
            if not left:
                raise
        reply = asks(**request)
    return first


def wait_for_plugin(process: subprocess.Popen | None = None) -> None:
    """Wait until the plugin accepts requests; the robot stays where it is. A `process` that ends is not waited for."""
    insist(process, state="reset")


def run(*command: str, **environment: str) -> tuple[int, str]:
    """Exit code and stderr of a command that ends by itself."""
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=START, check=False, env=os.environ | environment
    )
    return done.returncode, done.stderr


@contextlib.contextmanager
def started(*command: str, **environment: str) -> Iterator[subprocess.Popen]:
    """Run a process meanwhile."""
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=os.environ | environment
    ) as process:
        try:
            yield process
        except BaseException:
            # what it has started ends with it, and disturbs no later test
            with contextlib.suppress(subprocess.TimeoutExpired):
                end(process, signal.SIGINT)
            raise
        finally:
            process.kill()


def end(process: subprocess.Popen, number: signal.Signals, timeout: float = START) -> tuple[int, str]:
    """Send a signal; exit code and output of the process, which has to end within `timeout` [s]."""
    process.send_signal(number)
    output, _ = process.communicate(timeout=timeout)
    return process.returncode, output

"""Systems of processes that can be broken: nodes of ROS, or a real-time layer, with plugins that move a robot."""

import abc
import contextlib
import shutil
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from support.processes import LOOK, until

from breaking.processes import WAIT, Processes
from breaking.record import Record
from solfer.components.move_joints import MoveJoints, Reply
from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.segments.namespace import Namespace
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import Flag, NoFields

WHEELS = {"j_wheel_1": 1.0, "j_wheel_2": -1.0, "j_wheel_3": 1.0, "j_wheel_4": -1.0}
"""Wheels, and the signs of their speeds when the robot drives straight on: other ones drag its legs about."""

MOVED = {"upper": ("torso_yaw", "j_arm1_4"), "lower": ("ankle_yaw_1", "ankle_yaw_4")}
"""Joints of each part of the robot that move."""

LEGS = ("hip_", "knee_", "ankle_", "j_wheel_")
"""Beginnings of the names of the lower body's joints."""

PERIOD = 0.005
"""Simulated time between two joint states [s]."""

PATIENCE = 8.0
"""Time after which a request that was not carried out is repeated [s]."""

ANSWER = 3.0
"""Longest wait for an answer until the request is repeated [s]."""

SPEED = 0.5  # [rad/s], of joints
TRY = 0.5  # [rad/s], of wheels
NEAR = 0.05
"""How far a joint may end from its goal: a leg's springs give way to the weight [rad]."""

SLOW = 0.02
"""Largest speed of a joint that has arrived [rad/s]."""


def lower(joint: str) -> bool:
    """Return whether a joint is one of the lower body."""
    return joint.startswith(LEGS)


class Mover(NamedTuple):
    """The plugin that moves a part of the robot, in a process."""

    plugin: str
    process: str


class System(abc.ABC):
    """Processes, the robot that they move, and the plugins that are asked for motions.

    Args:
        commands: See `Processes`; the first one simulates.
        folder: Folder for the output of the processes, and for files.
        parts: The movers of the parts `upper` and `lower` of the robot.
        commander: The process that commands the robot.

    Attributes:
        record: What the robot did.
        processes: The processes.
        simulator: Name of the one that simulates.
        home: Where the joints of `MOVED` are between two motions [rad]; empty before `start`.
    """

    def __init__(self, commands: Mapping[str, Sequence[str]], folder: Path, parts: Mapping[str, Mover], commander: str):
        self.processes, self.record, self.home = Processes(commands, folder), Record(), {}
        self.simulator, self._parts, self._commander = next(iter(commands)), dict(parts), commander

    def ends(self, victim: str, restarts: bool) -> set[str]:
        """Find the parts that stop moving when a process is killed or stands still for long.

        Args:
            victim: The process.
            restarts: Whether its successor is started at once. One that merges references of others goes on with them.
        """
        if victim == self._commander and not restarts:
            return set(self._parts)
        return {part for part, mover in self._parts.items() if mover.process == victim}

    @abc.abstractmethod
    def call(self, plugin: str, request: MoveJoints) -> Reply:
        """Call a plugin.

        Raises:
            MiddlewareError: It does not answer.
        """

    def release(self) -> None:  # noqa: B027 most systems have nothing to release
        """Release what waits for an operator, such as an emergency stop."""

    def start(self) -> None:
        """Start everything, and wait until it carries out requests.

        Raises:
            AssertionError: It does not.
        """
        try:
            self._start()
        except AssertionError as error:
            raise AssertionError("; ".join([f"the system does not start: {error}", *self.processes.errors()])) from None

    def _start(self) -> None:
        self.revive()
        self.passes(1.0)
        self.home = {joint: self.record.position(joint) for part in MOVED.values() for joint in part}
        self.obey()

    def revive(self) -> None:
        """Start the processes that do not run: the simulator first, and the others when its robot is there."""
        missing = self.processes.missing()
        if self.simulator in missing:
            self.replace_robot()
            missing.remove(self.simulator)
        for name in missing:
            self.processes.start(name)

    def replace_robot(self) -> None:
        """Start the simulator, and wait until it publishes a robot that begins anew."""
        before, first = self.record.robots, not self.record
        self.processes.start(self.simulator)
        until(lambda: self.record and (first or self.record.robots > before), "a robot that begins anew")

    def passes(self, duration: float, begin: float | None = None) -> None:
        """Wait until `duration` [s] of the robot's time have passed, from now on or since `begin` [s]."""
        end = (self.record.time if begin is None else begin) + duration
        until(lambda: self.record.time >= end, f"{duration:g} s of the robot's time")

    def ask(
        self,
        part: str,
        positions: Sequence[float],
        speed: float = 0.0,
        before: Callable[[], None] = lambda: None,
    ) -> None:
        """Request a motion of a part until it is accepted: positions of its joints [rad], speed of its wheels [rad/s].

        Before each request it calls `before`.

        Raises:
            AssertionError: It is not accepted.
        """
        joints, zeros = MOVED[part], (0.0,) * len(MOVED[part])
        request = MoveJoints(joints=joints, positions=tuple(positions), speed=SPEED)
        if part == "lower":
            request = MoveJoints(
                joints=(*joints, *WHEELS),
                positions=(*positions, *(0.0 for _ in WHEELS)),
                velocities=(*zeros, *(sign * speed for sign in WHEELS.values())),
                speed=SPEED,
            )
        answer = "no answer"

        def accepted() -> bool:
            nonlocal answer
            before()
            try:
                reply = self.call(self._parts[part].plugin, request)
            except MiddlewareError as error:
                answer = str(error)
                return False
            answer = reply.message
            if not reply.success:
                time.sleep(0.05)
            return reply.success

        until(accepted, lambda: f"{self._parts[part].plugin} accepts a motion: {answer}")

    def obey(self, speed: float = TRY) -> None:
        """Request new motions: the joints go home, wheels turn at `speed` [rad/s], and then rest.

        Raises:
            AssertionError: They do not.
        """
        self._insist(0.0, self._at_home, "joints at home")
        self._insist(speed, lambda: self._turns(speed), "wheels that turn")
        self._insist(0.0, lambda: self._turns(0.0), "wheels that rest")

    def close(self) -> None:
        """End all processes."""
        self.processes.close()

    def _insist(self, speed: float, condition, what: str) -> None:
        """Repeat a request until it is done: a plugin that is late on a busy machine forgets it, which is right."""
        end = time.monotonic() + WAIT
        while True:
            self.release()
            for part, joints in MOVED.items():
                self.ask(part, [self.home[joint] for joint in joints], speed, self.release)
            try:
                return until(condition, what, PATIENCE)
            except AssertionError:
                if time.monotonic() > end:
                    raise

    def _at_home(self) -> bool:
        record = self.record
        return self._turns(0.0) and all(
            abs(record.position(joint) - place) < NEAR and abs(record.velocity(joint)) < SLOW
            for joint, place in self.home.items()
        )

    def _turns(self, speed: float) -> bool:
        return all(abs(self.record.velocity(wheel) - sign * speed) < 0.1 for wheel, sign in WHEELS.items())


class RosSystem(System):
    """Nodes of a ROS master; this process has to be one of its nodes already."""

    def __init__(self, commands: Mapping[str, Sequence[str]], folder: Path, parts: Mapping[str, Mover], commander: str):
        import rospy
        from sensor_msgs.msg import JointState

        super().__init__(commands, folder, parts, commander)
        self._subscriber = rospy.Subscriber(
            "/joint_states", JointState, self._receive, queue_size=2000, tcp_nodelay=True
        )

    def _receive(self, message) -> None:
        self.record.add(
            message.header.seq * PERIOD, tuple(message.name), np.array(message.position), np.array(message.velocity)
        )

    def call(self, plugin: str, request: MoveJoints) -> Reply:
        """See `System.call`."""
        return call_ros(plugin, request)

    def close(self) -> None:
        """See `System.close`."""
        self._subscriber.unregister()
        super().close()


def call_ros(plugin: str, request: MoveJoints) -> Reply:
    """Call a plugin over ROS.

    Raises:
        MiddlewareError: It does not answer.
    """
    from solfer.middleware.ros.calls import call

    response = call(f"/{plugin}/trajectory", "solfer/MoveJoints", request, ANSWER, lambda: True)
    return Reply(response.success, response.message, response.duration)


class XbotSystem(System):
    """A real-time layer in a namespace of its own.

    Args:
        commands: See `Processes`, without the namespace.
        name: Name of the namespace.
        folder: See `System`.
        layer: Plugins of the layer.
        parts: See `System`.
        commander: See `System`.
        outside: Plugins that are called over ROS.
    """

    def __init__(
        self,
        commands: Mapping[str, Sequence[str]],
        name: str,
        folder: Path,
        layer: Sequence[str],
        parts: Mapping[str, Mover],
        commander: str,
        outside: Collection[str] = (),
    ):
        super().__init__(commands, folder, parts, commander)
        self._namespace, self._layer, self._outside = Namespace(name), tuple(layer), tuple(outside)
        self._node = XbotMiddleware(self._namespace, "/breaking")
        self._queue = self._node.queue("joint_states", "sensor_msgs/JointState", 4096)
        self._closed = threading.Event()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def _listen(self) -> None:
        while not self._closed.wait(LOOK):
            for message in self._queue.drain():
                self.record.add(message.stamp, message.names, message.position.copy(), message.velocity.copy())

    def call(self, plugin: str, request: MoveJoints) -> Reply:
        """See `System.call`."""
        if plugin in self._outside:
            return call_ros(plugin, request)
        return self._node.call(f"{plugin}/trajectory", "solfer/MoveJoints", request, Reply, ANSWER)

    def release(self) -> None:
        """Clear an emergency stop that the watchdog has tripped, and let the layer's plugins run again."""
        until(self._released, lambda: f"a layer that starts again: {self._refusal}")

    def _released(self) -> bool:
        self._refusal = ""
        if not EmergencyStopLatch(self._namespace.folder):
            return True
        with contextlib.suppress(MiddlewareError):
            answer = self._node.call("xbotcore/estop_clear", "std_srvs/Trigger", NoFields(), Answer, ANSWER)
            if not answer.success:
                self._refusal = answer.message
                return False
            for plugin in self._layer:
                self._node.call(f"{plugin}/switch", "std_srvs/SetBool", Flag(True), Answer, ANSWER)
        return not EmergencyStopLatch(self._namespace.folder)

    def close(self) -> None:
        """See `System.close`; the namespace goes, too."""
        super().close()
        self._closed.set()
        self._listener.join()
        self._node.close()
        shutil.rmtree(self._namespace.folder, ignore_errors=True)

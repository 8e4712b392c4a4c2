"""A driver of an arm that is its lower level: plugins command it like the simulated robot.

python examples/arm_driver.py ROBOT    (a robot.yaml, or a URDF)
"""

from contextlib import closing
from typing import Protocol

import numpy as np

from solfer.lower_level import LowerLevelServer
from solfer.model import Kinematics
from solfer.simulation import read_bundle
from solfer.simulation.bundle import Bundle, load_bundle
from solfer.simulation.server.publications import robot_parameters
from solfer.transport import Inbox, Middleware
from solfer.transport.fixed_rate import FixedRateLoop
from solfer.transport.messages import JointMessage

RATE = 1000  # cycles of the driver [Hz]
PUBLISHED = 5  # cycles from one message of the joints to the next
REPORTED = 1000  # cycles from one health report to the next


class Device(Protocol):
    """What the arm's electronics offer, by whatever bus: numbers of all joints in the order of the model."""

    def read(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return positions [rad], velocities [rad/s] and torques [Nm], shape (n,) each."""

    def write(self, torque: np.ndarray) -> None:
        """Send desired torques [Nm], shape (n,)."""


class MockDevice:
    """Joints without friction that integrate the equation of motion; in its place comes the real device."""

    def __init__(self, kinematics: Kinematics):
        self._kinematics = kinematics
        self._position = np.zeros(kinematics.size)
        self._velocity = np.zeros(kinematics.size)
        self._torque = np.zeros(kinematics.size)

    def read(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See `Device.read`."""
        return self._position, self._velocity, self._torque

    def write(self, torque: np.ndarray) -> None:
        """Step by a cycle."""
        self._torque[:] = torque
        inertia = self._kinematics.inertia(self._position)
        bias = self._kinematics.bias(self._position, self._velocity)
        self._velocity += np.linalg.solve(inertia, torque - bias) / RATE
        self._position += self._velocity / RATE


class ArmDriver:
    """Receives commands, computes the laws of the lower level, and publishes what the joints measure.

    Args:
        bundle: The arm, with its controllers.
        device: Its electronics.
        middleware: The way to the plugins.
    """

    def __init__(self, bundle: Bundle, device: Device, middleware: Middleware):
        self._device = device
        self._middleware = middleware
        self._lower_level = bundle.lower_level
        self._inbox = Inbox()
        self._server = LowerLevelServer(self._lower_level, middleware, self._inbox)
        self._writer = middleware.writer("joint_states", "sensor_msgs/JointState")
        self._message = JointMessage.empty(bundle.kinematics.dofs, ("position", "velocity", "effort"))
        self._cycles = 0
        self._lower_level.start(device.read()[0])

    def cycle(self) -> None:
        """Make one cycle."""
        position, velocity, torque = self._device.read()
        if self._cycles % PUBLISHED == 0:
            numbers = self._message.block
            assert numbers is not None
            numbers[:] = position, velocity, torque
            self._message.stamp = self._middleware.now()
            self._writer.write(self._message)
        self._server.receive_commands()
        self._inbox.apply()
        torques, _ = self._lower_level.update(position, velocity, 1.0 / RATE)
        self._device.write(torques)
        if self._cycles % REPORTED == 0:
            self._server.report()
        self._cycles += 1


def main(argv: list[str]) -> int:
    """Run until the end is requested."""
    # imported here: the driver itself needs no ROS
    from solfer.middleware.ros import RosMiddleware, RosNode

    record = read_bundle(argv[1])
    bundle = load_bundle(record)
    with closing(RosMiddleware(RosNode("arm_driver", argv))) as middleware:
        for name, text in robot_parameters(record).items():
            middleware.provide(name, text)
        driver = ArmDriver(bundle, MockDevice(bundle.kinematics), middleware)
        FixedRateLoop(middleware, RATE).run(lambda late, skipped: driver.cycle(), middleware.running)
    return 0


if __name__ == "__main__":
    from solfer.middleware.ros import run_main

    run_main(main)

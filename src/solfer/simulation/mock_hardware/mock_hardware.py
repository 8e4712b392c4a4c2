"""A mock of a robot's hardware: the simulated robot behind other names, numbers, mountings, gains and delays."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from solfer.config import read
from solfer.errors import SimulationError
from solfer.simulation.bundle import read_bundle
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.delay_line import steps_of
from solfer.simulation.mock_hardware.encoders import Encoders
from solfer.simulation.mock_hardware.records import HardwareRecord
from solfer.simulation.mock_hardware.wiring import Wiring
from solfer.simulation.server.server import SimulationServer
from solfer.simulation.server.step_hooks import StepHook
from solfer.simulation.simulation import Simulation
from solfer.transport.lower_level import LOWER_LEVEL
from solfer.transport.middleware import Middleware

MOCK = "package://solfer/config/robots/centauro/hardware/mock.yaml"
"""The mock that is shipped, of CENTAURO."""


class MockHardware:
    """Offers a simulated robot like its hardware: on the topics of a SimulationServer.

    A command that is on its topic in one cycle reaches its controller `delay.command` later; what is measured in one
    cycle is on its topic `delay.measurement` later. The pose of a floating base is not published. Services are those of
    the lower level only.

    Args:
        simulation: The robot.
        record: How it looks from outside.
        middleware: The way to the plugins.
        factor: Simulated seconds for each real second in `run`; 0: as fast as possible.
        followers: Nodes that run in lock-step with the robot, or a check after each step; None: neither.

    Attributes:
        simulation: The robot as it really is.
        delay: Time between a measurement and its arrival outside [s].

    Raises:
        UnknownName: An encoder of a joint that the robot does not have.
        SimulationError: A joint without an encoder, two encoders of one name, or a delay that is not whole steps.
    """

    def __init__(
        self,
        simulation: Simulation,
        record: HardwareRecord,
        middleware: Middleware,
        factor: float = 1.0,
        followers: StepHook | None = None,
    ):
        self.simulation = simulation
        self.delay = record.delay.measurement
        encoders = Encoders(record.joints, simulation.body.joints, record.where("joints"))
        owners = (LOWER_LEVEL, *simulation.lower_level.controllers)
        measurement = steps_of(self.delay, record.where("delay", "measurement"))
        command = steps_of(record.delay.command, record.where("delay", "command"))
        truth = {topic for sensor in simulation.sensors.values() if sensor.truth for topic in sensor.topics}
        self._wiring = Wiring(  # type: ignore[abstract]
            middleware, encoders, owners, measurement=measurement, command=command, truth=truth
        )
        self._server = SimulationServer(simulation, self._wiring, factor=factor, name="hardware", followers=followers)

    @classmethod
    def from_file(
        cls, path: str | Path, middleware: Middleware, gui: bool = False, state: str | None = None, factor: float = 1.0
    ) -> MockHardware:
        """Make the mock that a file describes, such as config/robots/centauro/hardware/mock.yaml.

        Raises:
            ConfigError, ModelError, UnknownName, SimulationError: A file is wrong, or does not fit the robot.
        """
        record = read(path, HardwareRecord)
        simulation = Simulation.from_file(mounted(record), gui, state)
        try:
            return cls(simulation, record, middleware, factor=factor)
        except Exception:
            simulation.close()
            raise

    def cycle(self) -> None:
        """Make one step: commands that are due, the robot, and measurements that are due.

        Raises:
            SimulationError: The simulation diverged.
        """
        self._server.cycle()
        self._wiring.advance()

    def advance(self) -> None:
        """Make one step without commands and calls: the robot, and measurements that are due.

        Raises:
            SimulationError: The simulation diverged.
        """
        self._server.advance()
        self._wiring.advance()

    def wait(self) -> None:
        """Return when the next cycle is due."""
        self._server.wait()

    def run(self) -> None:
        """Cycle in real time until the middleware ends; the robot comes to rest before."""
        self._server.run(self.cycle)

    def rest(self, cycle: Callable[[], None] | None = None) -> None:
        """See `SimulationServer.rest`."""
        self._server.rest(cycle or self.cycle)

    def close(self) -> None:
        """Release the simulation. May be called twice."""
        self._server.close()
        self.simulation.close()


def mounted(record: HardwareRecord) -> BundleRecord:
    """Make the robot's bundle with the gains, the noise and the sensors' mounting of the hardware.

    Its sensors are not late: the delays are those of the hardware.

    Raises:
        SimulationError: An IMU is mounted, and the robot has none.
    """
    bundle = read_bundle(record.robot.location)
    sensors: Any = bundle.sensors  # with the tags of all kinds
    changes = {"seed": record.seed, "joint_noise": record.joint_noise, "delay": 0.0}
    if record.imu is not None:
        if sensors.imu is None:
            raise SimulationError(
                "the robot has no IMU that could be mounted",
                where=record.where("imu"),
                expected=f"'sensors: imu' in {record.robot.location}",
            )
        changes["imu"] = sensors.imu.model_copy(update=dict(record.imu))
    changed = {"sensors": sensors.model_copy(update=changes), "gains": record.gains or bundle.gains}
    return bundle.model_copy(update=changed)

"""The simulated robot of a plugin, in memory."""

from collections.abc import Callable

from solfer.config import Configuration
from solfer.errors import SimulationError
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.robot.description.shipped import RobotFiles, bundle_of
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.physics import STEP
from solfer.simulation.server.publications import robot_parameters


class StandingRobot:
    """A simulated robot that stands, on a virtual clock.

    Args:
        configuration: Of the plugin.
        given: Files of the robot, instead of those that the configuration names.
        where: Place of the configuration, for errors.

    Attributes:
        middleware: What the plugin is connected to.
        simulation: The robot.

    Raises:
        SolferError: There are no files of the robot, or they are wrong.
    """

    def __init__(self, configuration: Configuration, given: RobotFiles | None, where: str):
        file = bundle_of(configuration) if given is None else given.urdf
        if file is None:
            raise SimulationError(
                "its robot has no files here", where=where, expected="--urdf FILE, or --recording FILE"
            )
        bundle = read_bundle(file, None if given is None else given.srdf)
        self._bus = Bus(robot_parameters(bundle))
        self.simulation = Simulation.from_file(bundle)
        server = SimulationServer(self.simulation, MemoryMiddleware(self._bus, "simulator"))
        self.middleware = MemoryMiddleware(self._bus, configuration.module.name)
        self.every(STEP, server.cycle)

    @property
    def time(self) -> float:
        """The time that has passed [s]."""
        return self._bus.time

    def every(self, period: float, work: Callable[[], None]) -> None:
        """Do some work once each `period` [s]."""
        self._bus.every(period, work)

    def run(self, duration: float) -> None:
        """Let time pass [s]."""
        self._bus.run_until(self._bus.time + duration)

    def close(self) -> None:
        """Release the simulation."""
        self.simulation.close()

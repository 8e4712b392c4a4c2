"""Services of a simulator that a real robot does not offer."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from solfer.errors import SimulationError
from solfer.interfaces.declaration import Service
from solfer.simulation.robot_body.motors import DriveState
from solfer.simulation.robot_body.placement import StartPlacement
from solfer.simulation.simulation import Simulation
from solfer.transport.lower_level import Answer, answered_service
from solfer.transport.middleware import Flag

OWNER = "simulator"
"""Owner of these services."""


@dataclass(frozen=True)
class ResetRequest:
    """A state to begin in, and a place; see `Simulation.reset`. An empty state is the start, seed 0 the robot's own."""

    state: str = ""
    seed: int = 0
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    height: float = 0.0


@dataclass(frozen=True)
class StepRequest:
    """A number of steps."""

    count: int


@dataclass(frozen=True)
class PushRequest:
    """A wrench on a link; see `Pushes.add`."""

    link: str
    force: tuple[float, ...] = (0.0, 0.0, 0.0)
    torque: tuple[float, ...] = (0.0, 0.0, 0.0)
    duration: float = 0.0


@dataclass(frozen=True)
class FrictionRequest:
    """A friction coefficient; see `Simulation.set_friction`."""

    surface: str
    coefficient: float


@dataclass(frozen=True)
class DriveRequest:
    """A state of a joint's drive; see `Simulation.set_drive`."""

    joint: str
    state: DriveState


@dataclass(frozen=True)
class ScreenshotRequest:
    """The name of a picture, or its path in the folder of pictures."""

    path: str


class SteppedSimulation(Protocol):
    """The part of a simulation's server that its services use; see `SimulationServer`."""

    simulation: Simulation
    paused: bool

    def pause(self, paused: bool) -> None:
        """Let simulated time stand still, or go on."""

    def advance(self, count: int = 1) -> None:
        """Make steps, and publish what is due after each."""


def screenshot_service(screenshot: Callable[[str], Path]) -> Service:
    """Declare `simulator/screenshot`. Its handler waits for the picture: it has to run outside the server's loop.

    Args:
        screenshot: Draws a picture with a name, and returns its file.
    """
    return Service(
        "screenshot",
        "solfer/Screenshot",
        ScreenshotRequest,
        reply=Answer,
        handler=lambda request: Answer(True, str(screenshot(request.path))),
        timeout=20.0,  # the first picture starts a process
    )


def simulator_services(server: SteppedSimulation) -> tuple[Service, ...]:
    """Declare the services `simulator/<service>`. A wrong request is refused, and nothing changes."""
    simulation = server.simulation

    def reset(request: ResetRequest) -> None:
        placement = StartPlacement(request.x, request.y, request.yaw, height=request.height)
        simulation.reset(request.state or None, placement, request.seed or None)

    def step(request: StepRequest) -> None:
        if not server.paused:
            raise SimulationError("the simulation is not paused", expected="simulator/pause before")
        if not 1 <= request.count <= 1000:  # between two requests the simulator receives others
            raise SimulationError(f"{request.count} steps", expected="from 1 to 1000")
        server.advance(request.count)

    def push(request: PushRequest) -> None:
        simulation.pushes.add(request.link, request.force, request.torque, request.duration)

    def set_friction(request: FrictionRequest) -> None:
        simulation.set_friction(request.surface, request.coefficient)

    def set_drive(request: DriveRequest) -> None:
        simulation.set_drive(request.joint, request.state)

    return (
        answered_service("reset", "solfer/ResetSimulation", ResetRequest, work=reset),
        answered_service("pause", "std_srvs/SetBool", Flag, work=lambda request: server.pause(request.data)),
        answered_service("step", "solfer/StepSimulation", StepRequest, work=step),
        answered_service("push", "solfer/PushLink", PushRequest, work=push),
        answered_service("set_friction", "solfer/SetFriction", FrictionRequest, work=set_friction),
        answered_service("set_drive", "solfer/SetDrive", DriveRequest, work=set_drive),
    )

"""Services of a simulator: what a real robot does not offer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from solfer.components.declaration import Service
from solfer.errors import SimulationError
from solfer.pipes.lower_level import Answer, answered
from solfer.pipes.middleware import Flag
from solfer.simulation.placement import Placement

if TYPE_CHECKING:
    from solfer.simulation.server import SimulationServer

SIMULATOR = "simulator"
"""Owner of these services."""

LARGEST_COUNT = 1000
"""Steps of one request; between two requests the simulator hears others."""

DRAWING = 20.0
"""Longest time until a picture is there; the first one starts a process [s]."""

ZERO = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Reset:
    """A state to begin in, and a place; see `Simulation.reset`. An empty state is the start, seed 0 the robot's own."""

    state: str = ""
    seed: int = 0
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    height: float = 0.0


@dataclass(frozen=True)
class Step:
    """A number of steps."""

    count: int


@dataclass(frozen=True)
class Push:
    """A wrench on a link; see `Pushes.add`."""

    link: str
    force: tuple[float, ...] = ZERO
    torque: tuple[float, ...] = ZERO
    duration: float = 0.0


@dataclass(frozen=True)
class SetFriction:
    """A friction coefficient; see `Simulation.set_friction`."""

    surface: str
    coefficient: float


@dataclass(frozen=True)
class Screenshot:
    """The file of a picture."""

    path: str


def screenshot_service(server: SimulationServer) -> Service:
    """`simulator/screenshot`. Its handler waits for the picture: it has to run outside the server's loop."""

    return Service("screenshot", "solfer/Screenshot", Screenshot, Answer,
                   answered(lambda request: server.screenshot(request.path)), DRAWING)


def simulator_services(server: SimulationServer) -> tuple[Service, ...]:
    """What a simulator offers as `simulator/<service>`. A wrong request is refused, and nothing changes."""
    simulation = server.simulation

    def reset(request: Reset) -> None:
        placement = Placement(request.x, request.y, request.yaw, request.height)
        simulation.reset(request.state or None, placement, request.seed or None)

    def step(request: Step) -> None:
        if not server.paused:
            raise SimulationError("the simulation is not paused", expected="simulator/pause before")
        if not 1 <= request.count <= LARGEST_COUNT:
            raise SimulationError(f"{request.count} steps", expected=f"from 1 to {LARGEST_COUNT}")
        server.advance(request.count)

    def push(request: Push) -> None:
        simulation.pushes.add(request.link, request.force, request.torque, request.duration)

    def set_friction(request: SetFriction) -> None:
        simulation.set_friction(request.surface, request.coefficient)

    return (
        Service("reset", "solfer/ResetSimulation", Reset, Answer, answered(reset)),
        Service("pause", "std_srvs/SetBool", Flag, Answer, answered(lambda request: server.pause(request.data))),
        Service("step", "solfer/StepSimulation", Step, Answer, answered(step)),
        Service("push", "solfer/PushLink", Push, Answer, answered(push)),
        Service("set_friction", "solfer/SetFriction", SetFriction, Answer, answered(set_friction)),
    )

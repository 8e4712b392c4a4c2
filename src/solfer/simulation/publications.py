"""What a simulated robot tells about itself, and how often."""

from collections.abc import Callable
from dataclasses import dataclass

from solfer.errors import SimulationError
from solfer.pipes.messages import Message
from solfer.pipes.middleware import Middleware, Writer
from solfer.simulation.engine import STEP
from solfer.simulation.simulation import Simulation


@dataclass(frozen=True)
class Rates:
    """Rates of publication in simulated time [Hz]; each is the rate of the steps divided by a whole number."""

    joints: float = 200.0
    base: float = 200.0


@dataclass(frozen=True)
class Publication:
    """A message that is written once every `steps` steps."""

    steps: int
    writer: Writer
    message: Callable[[], Message]


def publications(simulation: Simulation, middleware: Middleware, rates: Rates) -> list[Publication]:
    """All that a simulated robot publishes.

    Raises:
        SimulationError: A rate is not the rate of the steps divided by a whole number.
    """
    told = [Publication(every(rates.joints), middleware.writer("joint_states", "sensor_msgs/JointState"),
                        simulation.joint_message)]
    if simulation.floating:
        told.append(Publication(every(rates.base), middleware.writer("floating_base", "nav_msgs/Odometry"),
                                simulation.base_message))
    return told


def every(rate: float) -> int:
    """Steps between two publications at `rate` [Hz].

    Raises:
        SimulationError: That is no whole number of steps.
    """
    steps = round(1.0 / (rate * STEP)) if rate > 0.0 else 0
    if steps < 1 or abs(steps * rate * STEP - 1.0) > 1e-9:
        raise SimulationError(f"{rate:g} Hz is no rate of publication",
                              expected=f"{1.0 / STEP:g} Hz divided by a whole number")
    return steps

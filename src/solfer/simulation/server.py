"""Offers a simulation to plugins, in the way in which a robot offers itself."""

import logging
from collections.abc import Callable

from solfer.errors import CommandRefused, SimulationError
from solfer.logs import Throttle
from solfer.lower_level.services import controller_services
from solfer.pipes.inbox import Inbox
from solfer.pipes.messages import JointMessage, Message
from solfer.pipes.middleware import Middleware, Queue, Writer
from solfer.simulation.engine import STEP
from solfer.simulation.pace import Pace
from solfer.simulation.simulation import Simulation

JOINT_RATE, BASE_RATE, HEALTH_RATE = 200.0, 200.0, 1.0  # [Hz] of simulated time


class SimulationServer:
    """Takes commands, steps the simulation, and publishes what a robot's sensors tell.

    Topics: `<controller>/command` (solfer/JointCommand) in, `joint_states` (sensor_msgs/JointState) and, if the base
    floats, `floating_base` (nav_msgs/Odometry) out. Services: `<controller>/get_joint_names`.

    Args:
        simulation: The robot in its world.
        middleware: The way to the plugins.
        joint_rate: Rate of `joint_states` in simulated time [Hz].
        base_rate: Rate of `floating_base` [Hz].
        factor: Simulated seconds for each real second in `run`; 0: as fast as possible.

    Attributes:
        inbox: Calls from outside, carried out between two steps.
        pace: Tells the real-time factor and the time lost.

    Raises:
        SimulationError: A rate is not the rate of the steps divided by a whole number.
    """

    def __init__(self, simulation: Simulation, middleware: Middleware, joint_rate: float = JOINT_RATE,
                 base_rate: float = BASE_RATE, factor: float = 1.0):
        self.simulation, self.middleware = simulation, middleware
        self.pace = Pace(middleware.now, middleware.sleep_until, factor)
        self._throttle = Throttle(logging.getLogger(__name__))
        self.inbox = Inbox()
        self._refused, self._lost = simulation.lower_level.refused, 0.0
        self._queues: list[tuple[str, Queue]] = []
        for name, controller in simulation.lower_level.controllers.items():
            self._queues.append((name, middleware.queue(f"{name}/command", "solfer/JointCommand")))
            middleware.serve(name, controller_services(controller), self.inbox.submit)
        self._publications = [(_every(joint_rate), self._publish(
            middleware.writer("joint_states", "sensor_msgs/JointState"), simulation.joint_message))]
        if simulation.floating:
            self._publications.append((_every(base_rate), self._publish(
                middleware.writer("floating_base", "nav_msgs/Odometry"), simulation.base_message)))
        self._publications.append((_every(HEALTH_RATE), self._report))

    def cycle(self) -> None:
        """Commands and service calls that have come, one step, publications that are due.

        Raises:
            SimulationError: The simulation diverged.
        """
        self.inbox.apply()
        for controller, queue in self._queues:
            for message in queue.drain():
                self._accept(controller, message)
        self.simulation.step()
        for steps, publish in self._publications:
            if self.simulation.count % steps == 0:
                publish()

    def run(self) -> None:
        """Cycle in real time until the middleware ends."""
        while self.middleware.running():
            self.cycle()
            self.pace.wait(self.simulation.time)

    def _accept(self, controller: str, message: JointMessage) -> None:
        try:
            self.simulation.lower_level.accept(controller, message)
        except CommandRefused as error:
            self._throttle.warning(f"{controller} {message.sender}", "refused: %s", error)

    def _publish(self, writer: Writer, message: Callable[[], Message]) -> Callable[[], None]:
        return lambda: writer.write(message())

    def _report(self) -> None:
        """Health: how fast, what was lost, what was refused, what touches the ground."""
        pace, refused = self.pace, self.simulation.lower_level.refused
        news = []
        if refused > self._refused:
            news.append(f"{refused - self._refused} commands refused")
        if pace.lost > self._lost:
            news.append(f"{pace.lost - self._lost:.3f} s lost")
        self._refused, self._lost = refused, pace.lost
        self.middleware.report("simulation", 1 if news else 0, ", ".join(news) or "running", {
            "time [s]": self.simulation.time,
            "real-time factor": pace.measured,
            "time lost [s]": pace.lost,
            "commands refused": refused,
            "commands dropped": sum(queue.dropped for _, queue in self._queues),
            "contacts": " ".join(self.simulation.contact_links()),
        })


def _every(rate: float) -> int:
    """Steps between two publications."""
    steps = round(1.0 / (rate * STEP)) if rate > 0.0 else 0
    if steps < 1 or abs(steps * rate * STEP - 1.0) > 1e-9:
        raise SimulationError(f"{rate:g} Hz is no rate of publication",
                              expected=f"{1.0 / STEP:g} Hz divided by a whole number")
    return steps

"""Offers a simulation to plugins, just as a robot offers itself."""

import logging
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from solfer.errors import SimulationError
from solfer.lower_level import LowerLevelServer
from solfer.simulation.physics import STEP
from solfer.simulation.rendering.pictures import Pictures
from solfer.simulation.robot_body.placement import sunk
from solfer.simulation.sensors import Rates
from solfer.simulation.server.pace import Pace
from solfer.simulation.server.publications import publications
from solfer.simulation.server.rates import every
from solfer.simulation.server.screenshots import Screenshots
from solfer.simulation.server.services import OWNER, screenshot_service, simulator_services
from solfer.simulation.server.step_hooks import StepHook
from solfer.simulation.simulation import Simulation
from solfer.transport.health import Health
from solfer.transport.inbox import Inbox
from solfer.transport.middleware import Middleware

logger = logging.getLogger(__name__)

COAST_TIME = 1.0
"""Simulated time in which a robot without commands comes to rest [s]."""

PAUSE_PERIOD = 0.02
"""Time between two checks for requests and commands while simulated time stands still [s]."""


class _Losses:
    """What has gone wrong since the last report.

    Args:
        simulation: The simulation.
        pace: Measures the time lost.

    Attributes:
        faults: Faults of the simulation since then.
    """

    def __init__(self, simulation: Simulation, pace: Pace):
        self._lower_level = simulation.lower_level
        self._pace = pace
        self._refused = simulation.lower_level.refused
        self._lost = 0.0
        self.faults: list[str] = []

    def since_last(self) -> tuple[Health, str]:
        """Return the health since the last call, and what has gone wrong; empty: nothing."""
        refused = self._lower_level.refused
        lost = self._pace.lost
        news = self.faults
        level = Health.ERROR if news else Health.WARNING
        self.faults = []
        if refused > self._refused:
            news.append(f"{refused - self._refused} commands refused")
        if lost > self._lost:
            news.append(f"{lost - self._lost:.3f} s lost")
        self._refused = refused
        self._lost = lost
        return (level if news else Health.GOOD), ", ".join(news)


class SimulationServer:
    """Receives commands, steps the simulation, and publishes what a robot's sensors measure.

    Topics: `<controller>/command` (solfer/JointCommand) in, what the sensors measure out: `joint_states` and
    `motor_states` (sensor_msgs/JointState), `imu` (sensor_msgs/Imu), `contacts/<contact>` in the axes of the world and
    `contacts/<contact>/link` in those of the link (geometry_msgs/WrenchStamped); and, if the base floats,
    `floating_base` (nav_msgs/Odometry), which no sensor could measure. Services: those of the lower level, and
    `simulator/...` (solfer.simulation.server.services).

    Args:
        simulation: The robot in its world.
        middleware: The way to the plugins.
        rates: Rates of publication; None: those of the simulation's sensors.
        factor: Simulated seconds for each real second in `run`; 0: as fast as possible.
        name: Name of the health report.
        followers: Nodes that run in lock-step with the simulation; None: no node.
        pictures: Where pictures are written; None: in the user's own folder.

    Attributes:
        inbox: Calls from outside, carried out between two steps.
        pace: Measures the real-time factor and the time lost.
        paused: Whether simulated time stands still. Then nothing ages, commands and requests are received as ever, and
            the last measurements are published again and again, so that no feedback times out.
        stands: Whether it stood still in the newest cycle: it is paused, or a follower is not there.

    Raises:
        SimulationError: A rate is not the rate of the steps divided by a whole number.
    """

    def __init__(
        self,
        simulation: Simulation,
        middleware: Middleware,
        rates: Rates | None = None,
        factor: float = 1.0,
        name: str = "simulation",
        *,
        followers: StepHook | None = None,
        pictures: Pictures | None = None,
    ):
        self.simulation = simulation
        self.middleware = middleware
        self._name = name
        self.pace = Pace(middleware, factor)
        ration = simulation.lower_level.ration
        self.inbox = Inbox(ration=ration.requests, waiting=ration.waiting)
        self.paused = False
        self.stands = False
        self._idle = 0.0
        self._followers = followers or StepHook()
        self._losses = _Losses(simulation, self.pace)
        self._diverged = -math.inf
        self._lower_level = LowerLevelServer(simulation.lower_level, middleware, self.inbox)
        self._publications = publications(simulation, middleware, rates or simulation.sensors.rates)
        self._health = every(1.0)
        middleware.serve(OWNER, simulator_services(self), self.inbox.submit)
        self._screenshots = Screenshots(simulation, self.inbox, pictures or Pictures())
        middleware.serve(OWNER, (screenshot_service(self.screenshot),), self._screenshots.submit)
        if inside := sunk(simulation.body, simulation.world):
            logger.warning("%s", inside)

    def cycle(self) -> None:
        """Receive commands and service calls, make one step unless time stands still, publish what is due.

        Raises:
            SimulationError: The simulation diverged, and had done so shortly before.
        """
        self._lower_level.receive_commands()
        self.inbox.apply()
        self.stands = self.paused or not self._followers.present()
        if self.stands:
            self._repeat()
        else:
            self.advance()

    def advance(self, count: int = 1) -> None:
        """Make steps, and publish what is due after each.

        Raises:
            SimulationError: The simulation diverged, and had done so shortly before.
        """
        for _ in range(count):
            try:
                self.simulation.step()
            except SimulationError as error:
                self._recover(error)
            self.middleware.publish_time(self.simulation.time)
            done = self.simulation.count
            for publication in self._publications:
                if publication.next <= done:
                    publication.step(done)
            if done % self._health == 0:
                self._report()
            self._followers.follow(self.simulation.time, self.inbox.apply)

    def pause(self, paused: bool) -> None:
        """Let simulated time stand still, or go on."""
        self.paused = paused
        self.pace.restart()
        self._report()

    def screenshot(self, name: str) -> Path:
        """Write a picture of the world between two steps to a PNG file, while the simulation goes on.

        To be called from another thread than the one that cycles.

        Args:
            name: Name of the picture, or its path in the folder of pictures.

        Returns:
            The file.

        Raises:
            SimulationError: The name is wrong, the file cannot be written, or the simulation does not run.
        """
        return self._screenshots.take(name)

    def close(self) -> None:
        """End the process that draws."""
        self._screenshots.close()

    def wait(self) -> None:
        """Return when the next cycle is due."""
        if self.stands:
            self.pace.restart()
            self.middleware.sleep_until(self.middleware.now() + PAUSE_PERIOD)
        else:
            self.pace.wait(self.simulation.time)

    def run(self, cycle: Callable[[], None] | None = None) -> None:
        """Cycle in real time until the middleware ends; the robot comes to rest before.

        Args:
            cycle: Makes a cycle, instead of `cycle`.
        """
        while self.middleware.running():
            (cycle or self.cycle)()
            self.wait()
        self.rest(cycle)

    def rest(self, cycle: Callable[[], None] | None = None) -> None:
        """Let the robot come to rest at the end.

        Those who command it mostly end at the same time, in order, and have it brake. If the middleware was lost, or
        they go on, all leases end. In lock-step time stands still without the others. Subscribers that still receive a
        topic see how that ends.

        Args:
            cycle: Makes a cycle, instead of `cycle`.
        """
        loss = self.middleware.loss or self._linger(cycle or self.cycle)
        if loss:
            owners = self.simulation.lower_level.release_all(loss)
            logger.warning("the robot holds%s: %s", f", which {', '.join(owners)} commanded" if owners else "", loss)
            for _ in range(round(COAST_TIME / STEP)):
                (cycle or self.cycle)()
        moving = ", ".join(f"{name} {speed:.2f}" for name, speed in self._moving().items())
        logger.info("the simulation ends %s", f"while joints move [rad/s, m/s]: {moving}" if moving else "at rest")

    def _linger(self, cycle: Callable[[], None]) -> str:
        """Go on as long as the robot moves; return why that is to end, empty: it rests."""
        left = round(COAST_TIME / STEP) if isinstance(self._followers, StepHook) and not self.paused else 0
        while left and self._moving():
            cycle()
            self.wait()
            left -= 1
            if not left:
                return "the simulation ends"
        return ""

    def _moving(self) -> dict[str, float]:
        """Return the speeds of the joints that do not rest, by their names [rad/s, m/s]."""
        joints = self.simulation.body.joints
        speeds = np.abs(self.simulation.v[-len(joints) :]).tolist() if joints else ()
        return {name: speed for name, speed in zip(joints, speeds, strict=True) if speed > 0.05}

    def _recover(self, error: SimulationError) -> None:
        """Put the robot into its start, as a reset does; raise `error` if that was done a moment ago."""
        time = self.simulation.time
        if time - self._diverged < 1.0:  # [s]; it has no good state
            raise error
        logger.error("%s: the robot is put into its start", error)
        self._diverged = time
        self.simulation.recover()
        self._losses.faults.append(str(error))

    def _repeat(self) -> None:
        """Publish the last measurements once more."""
        now = self.middleware.now()
        if now - self._idle >= PAUSE_PERIOD:
            self._idle = now
            for publication in self._publications:
                publication.repeat()

    def _report(self) -> None:
        """Report the health: how fast, what was lost, what was refused, what touches the ground."""
        pace = self.pace
        level, news = self._losses.since_last()
        life = "paused" if self.paused else "running"
        # in memory others let time pass
        paced = {"real-time factor": pace.measured, "time lost [s]": pace.lost} if pace.measured else {}
        self.middleware.report(
            self._name,
            level,
            news or life,
            {
                "time [s]": self.simulation.time,
                **paced,
                "commands refused": self.simulation.lower_level.refused,
                "commands dropped": self._lower_level.dropped,
                "contacts": " ".join(self.simulation.contact_links()),
            },
        )
        self._lower_level.report()

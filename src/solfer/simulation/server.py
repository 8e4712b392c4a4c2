"""Offers a simulation to plugins, in the way in which a robot offers itself."""

from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeout

from solfer.errors import SimulationError
from solfer.lower_level import LowerLevelServer
from solfer.pipes.inbox import Inbox
from solfer.pipes.middleware import Middleware
from solfer.simulation.camera import Camera, Scene, Shot
from solfer.simulation.followers import Followers
from solfer.simulation.pace import Pace
from solfer.simulation.publications import publications
from solfer.simulation.rates import every
from solfer.simulation.sensors import Rates
from solfer.simulation.services import SIMULATOR, screenshot_service, simulator_services
from solfer.simulation.simulation import Simulation

HEALTH = "simulation"
"""Name of the health report."""

HEALTH_RATE = 1.0  # [Hz] of simulated time
STANDSTILL = 2.0  # [s] without a cycle until a picture is given up
IDLE = 0.02  # [s] between two looks at requests and commands while paused


class SimulationServer:
    """Takes commands, steps the simulation, and publishes what a robot's sensors tell.

    Topics: `<controller>/command` (solfer/JointCommand) in, what the sensors measure out: `joint_states` and
    `motor_states` (sensor_msgs/JointState), `imu` (sensor_msgs/Imu), `contacts/<contact>` in the axes of the world and
    `contacts/<contact>/link` in those of the link (geometry_msgs/WrenchStamped); and, if the base floats,
    `floating_base` (nav_msgs/Odometry), which no sensor could tell. Services: those of the lower level, and
    `simulator/...` (solfer.simulation.services).

    Args:
        simulation: The robot in its world.
        middleware: The way to the plugins.
        rates: Rates of publication; None: those of the simulation's sensors.
        factor: Simulated seconds for each real second in `run`; 0: as fast as possible.
        name: Name of the health report.
        followers: Who works in lock-step with the simulation; None: nobody.

    Attributes:
        inbox: Calls from outside, carried out between two steps.
        pace: Tells the real-time factor and the time lost.
        paused: Whether simulated time stands still. Then nothing ages, commands and requests are taken as ever, and
            what was measured last is told again and again, so that nobody takes the robot for dead.
        stands: Whether it stood still in the newest cycle: it is paused, or a follower is not there.

    Raises:
        SimulationError: A rate is not the rate of the steps divided by a whole number.
    """

    def __init__(self, simulation: Simulation, middleware: Middleware, rates: Rates | None = None,
                 factor: float = 1.0, name: str = HEALTH, followers: Followers | None = None):
        self.simulation, self.middleware, self._name = simulation, middleware, name
        self.pace = Pace(middleware.now, middleware.sleep_until, factor)
        self.inbox, self.paused, self.stands, self._idle = Inbox(), False, False, 0.0
        self._followers = followers or Followers()
        self._refused, self._lost = simulation.lower_level.refused, 0.0
        self._lower_level = LowerLevelServer(simulation.lower_level, middleware, self.inbox)
        self._publications = publications(simulation, middleware, rates or simulation.sensors.rates)
        self._health = every(HEALTH_RATE)
        middleware.serve(SIMULATOR, simulator_services(self), self.inbox.submit)
        description, floating = simulation.kinematics.description, simulation.floating
        self._camera = Camera(Scene(description.text, description.where, floating, simulation.world.record))
        self._drawing = ThreadPoolExecutor(1)
        middleware.serve(SIMULATOR, (screenshot_service(self),), self._drawing.submit)

    def cycle(self) -> None:
        """Commands and service calls that have come, one step unless time stands still, publications that are due.

        Raises:
            SimulationError: The simulation diverged.
        """
        self._lower_level.take_commands()
        self.inbox.apply()
        self.stands = self.paused or not self._followers.present()
        if self.stands:
            self._repeat()
        else:
            self.advance()

    def advance(self, count: int = 1) -> None:
        """Steps with the publications that are due after each.

        Raises:
            SimulationError: The simulation diverged.
        """
        for _ in range(count):
            self.simulation.step()
            self.middleware.tell_time(self.simulation.time)
            done = self.simulation.count
            for publication in self._publications:
                if done % publication.steps == 0:
                    publication.publish()
            if done % self._health == 0:
                self._report()
            self._followers.follow(self.simulation.time, self.inbox.apply)

    def pause(self, paused: bool) -> None:
        """Let simulated time stand still, or go on."""
        self.paused = paused
        self.pace.restart()
        self._report()

    def screenshot(self, path: str) -> None:
        """Write a picture of the world between two steps to a PNG file, while the simulation goes on.

        To be called from another thread than the one that cycles.

        Raises:
            SimulationError: The path is wrong, the file cannot be written, or nobody cycles.
        """
        simulation = self.simulation
        moment = self.inbox.submit(lambda: Shot(simulation.q.copy(), simulation.world.poses(), path))
        try:
            shot = moment.result(STANDSTILL)
        except FutureTimeout as error:
            moment.cancel()
            raise SimulationError("the simulation does not run") from error
        self._camera.take(shot)

    def close(self) -> None:
        """End the process that draws."""
        self._camera.close()
        self._drawing.shutdown()

    def wait(self) -> None:
        """Return when the next cycle is due."""
        if self.stands:
            self.pace.restart()
            self.middleware.sleep_until(self.middleware.now() + IDLE)
        else:
            self.pace.wait(self.simulation.time)

    def run(self) -> None:
        """Cycle in real time until the middleware ends."""
        while self.middleware.running():
            self.cycle()
            self.wait()

    def _repeat(self) -> None:
        """Tell once more what was measured last."""
        now = self.middleware.now()
        if now - self._idle >= IDLE:
            self._idle = now
            for publication in self._publications:
                publication.publish()

    def _report(self) -> None:
        """Health: how fast, what was lost, what was refused, what touches the ground."""
        pace, refused = self.pace, self.simulation.lower_level.refused
        news = []
        if refused > self._refused:
            news.append(f"{refused - self._refused} commands refused")
        if pace.lost > self._lost:
            news.append(f"{pace.lost - self._lost:.3f} s lost")
        self._refused, self._lost = refused, pace.lost
        life = "paused" if self.paused else "running"
        self.middleware.report(self._name, 1 if news else 0, ", ".join(news) or life, {
            "time [s]": self.simulation.time,
            "real-time factor": pace.measured,
            "time lost [s]": pace.lost,
            "commands refused": refused,
            "commands dropped": self._lower_level.dropped,
            "contacts": " ".join(self.simulation.contact_links()),
        })
        self._lower_level.report()

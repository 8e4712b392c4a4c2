"""The base class of all components (Listing 15 of the paper)."""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from solfer.errors import ComponentError
from solfer.interfaces.declaration import Action, LiveParameter, Parameter, Service, TopicIn, TopicOut
from solfer.interfaces.port import Port

if TYPE_CHECKING:
    from solfer.numerics.planar_move import PlanarMove
    from solfer.recording.log import Logger
    from solfer.robot import Robot


class Component:
    """An algorithm: it reads a Robot's state and writes the Robot's desired state.

    `init`, `stop` and `close` may block; `update` and `send` run in the cycle and must not. A component knows no pipe,
    no middleware and no other component.

    Attributes:
        Tags: Record (a pydantic model) of the component's own tags in the configuration.
        kinematics: Whether the Robot's kinematics are brought up to date before each `update`.
        dynamics: Whether `model.dynamics` is, too: what is subscribed there is computed before each `update`.
        modify: Whether it writes the measured state that it reads; who reads it next computes kinematics again.
        period: Time of one control cycle [s]; 0 before `set_rate`.
        passed: Time that has passed for the robot since the cycle before [s]: `period`, or several of them where a loop
            that was late left some out; less where the robot is slower than the clock, as in a slow simulation.
        time_step: Time over which it integrates in this cycle [s]: `passed`, but no more than 0.05 s or the period.
        time_lost: Time that has passed by the clock meanwhile, and not for the robot [s].
            What times out or brakes counts with it.
        pace: Share of their speed with which motions may go on, below 1 while the loop is too slow for the robot.
        start_position: Where the joints are at `init`, shape (n,) [rad, m]: where they are measured, and after a short
            interruption where they were commanded to be, as long as they follow that as springs do under a load.
        model: The Robot that it works on.
        name: Name of its configuration.
        efforts: DoFs that it moves by their efforts, shape (m,): pipes have to carry them.
        inputs: Robot Points that the component receives from others, by name; it adds its ports when it is made.
        outputs: Robot Points that it publishes, by name.
        clock: Returns the time in which messages of its declarations are stamped [s].
    """

    Tags: ClassVar[type | None] = None

    def __init__(self, robot: "Robot", tags: Any = None, name: str = ""):
        self.model = robot
        self.tags = tags
        self.name = name or type(self).__name__
        self.kinematics = True
        self.dynamics = False
        self.modify = False
        self.period = self.passed = self.time_step = self.time_lost = 0.0
        self.pace = 1.0
        self.start_position = robot.state.position
        self.efforts: np.ndarray = np.zeros(0, dtype=np.int64)
        self.inputs: dict[str, Port] = {}
        self.outputs: dict[str, Port] = {}
        self.clock: Callable[[], float] = float

    def set_rate(self, rate: float) -> None:
        """Set the rate of the control cycle [Hz]; called once before `init`.

        Raises:
            ComponentError: `rate` is not a positive number.
        """
        if not 0.0 < rate < math.inf:
            raise ComponentError(f"'{self.name}' at a rate of {rate} Hz", expected="a positive number")
        self.period = 1.0 / rate
        self.let_pass(self.period)

    def let_pass(self, passed: float, lost: float = 0.0) -> None:
        """Let time pass until the next cycle, some of it `lost` [s]; after a gap motions go on from where they are."""
        self.passed = passed
        self.time_lost = lost
        self.time_step = min(passed, max(self.period, 0.05))

    def needs_base(self) -> bool:
        """Return whether a feedback has to measure the floating base, an IMU at least."""
        return False

    def init(self) -> None:
        """Set the initial conditions; the Robot's state is measured and its kinematics are up to date."""

    def update(self) -> None:
        """Compute one cycle."""

    def move_world(self, move: "PlanarMove") -> None:
        """Move references that are given in the world: the estimate of the base has jumped, the robot has not.

        Called before `update`, where a component of a Robot with a floating base defines it. Velocities go on as seen
        from the robot; what is to be reached in the world counts again with the next message of it.
        """

    def send(self) -> None:
        """Write the result into the Robot's desired state."""

    def reset(self) -> None:
        """Forget past states and requests.

        Called once, between two cycles, when a component that runs has to begin again: the plugin holds because
        a feedback timed out or its joints are not its own, its loop stood still, or the simulation began again. Nothing
        is sent until everything required has been received again; then `init` follows.
        """

    def stop(self) -> None:
        """Bring the desired state to rest; called when the plugin stops, before the last `send` to the pipes."""

    def close(self) -> None:
        """Release the component's resources."""

    def start_log(self, logger: "Logger") -> None:
        """Declare what is recorded: live arrays of the component, `logger.add(name, array, columns, unit, frame)`.

        Called once, before the first cycle, if the plugin is recorded. Rows are taken after each cycle, from the arrays
        as they are then, as the channels `<plugin>/log/<name>`.
        """

    def log(self, logger: "Logger", time: float) -> None:
        """Fill those arrays that `update` and `send` do not; called after each `send`, and must not block either.

        Args:
            logger: That of `start_log`.
            time: Time since the start of the plugin [s].
        """

    def services(self) -> Sequence[Service]:
        """Return the services that the component offers."""
        return ()

    def topics(self) -> Sequence[TopicIn | TopicOut]:
        """Return the topics that the component receives and publishes besides its pipes."""
        return ()

    def actions(self) -> Sequence[Action]:
        """Return the actions that the component offers."""
        return ()

    def parameters(self) -> Sequence[Parameter]:
        """Return the parameters that the component reads at its start, besides its tags."""
        return ()

    def live_parameters(self) -> Sequence[LiveParameter]:
        """Return the tags that can be changed while the component runs; called once, after `set_rate`."""
        return ()

"""What the robot does in the demonstration, told to the service of the plugin `joint_states`."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solfer.components.joint_states import MoveJoints, Reply
from solfer.demo.record import Recorder
from solfer.errors import ComponentError, MiddlewareError
from solfer.pipes import Middleware

SERVICE, INTERFACE = "joint_states/trajectory", "solfer/MoveJoints"
ACCELERATION = 3.0
"""Rate of change of the wheels' speed that the plugin is configured with [rad/s2]."""


@dataclass(frozen=True)
class Step:
    """One motion.

    Attributes:
        title: What a reader is told.
        request: What the plugin is asked.
        duration: How long the motion takes [s]; None for what the plugin answers.
    """

    title: str
    request: MoveJoints
    duration: float | None = None


def posture(state: str, speed: float = 0.5) -> list[Step]:
    """Move to a named state with at most `speed` [rad/s]."""
    return [Step(state, MoveJoints(state=state, speed=speed))]


def drive(distance: float, radius: float, forward: dict[str, float], speed: float = 2.5) -> list[Step]:
    """Roll on all wheels in a straight line.

    Args:
        distance: How far, negative for backwards [m].
        radius: Radius of the wheels [m].
        forward: Sign of the speed of each wheel joint for forward motion.
        speed: Speed of the wheels [rad/s].
    """
    angle = abs(distance) / radius
    speed = min(speed, float(np.sqrt(angle * ACCELERATION)))
    joints = tuple(forward)
    turn = tuple(float(np.sign(distance)) * speed * sign for sign in forward.values())
    way = "forward" if distance > 0.0 else "back"
    return [
        Step(f"{abs(distance):g} m {way}", MoveJoints(joints=joints, velocities=turn), angle / speed),
        Step("wheels stop", MoveJoints(joints=joints, velocities=(0.0,) * len(joints))),
    ]


class Teller:
    """Carries out steps and records meanwhile.

    Args:
        middleware: Where the plugin is.
        recorder: Keeps what happens.
        progress: Called with the title, the time since the start of the step and its duration [s].
    """

    def __init__(self, middleware: Middleware, recorder: Recorder, progress: Callable[[str, float, float], None]):
        self._middleware, self._recorder, self._progress = middleware, recorder, progress

    def wait_for_robot(self, timeout: float, check: Callable[[], None] = lambda: None) -> None:
        """Wait until the robot is heard and the plugin accepts requests, or the middleware ends.

        Args:
            timeout: Longest wait [s].
            check: Called meanwhile; raises if waiting makes no sense any more.

        Raises:
            MiddlewareError: That did not happen within `timeout`.
        """
        end = self._middleware.now() + timeout
        problem = "the robot publishes no joint states"
        while self._middleware.now() < end and self._middleware.running():
            self._pass(self._middleware.now() + 0.1)
            check()
            if self._recorder.newest("measured") is None:
                continue
            try:
                reply = self._ask(MoveJoints(state="reset"))
            except MiddlewareError as error:
                problem = str(error)
                continue
            if reply.success:
                return
            problem = reply.message
        if self._middleware.running():
            raise MiddlewareError(f"not ready within {timeout:g} s: {problem}")

    def tell(self, step: Step, settle: float = 0.3) -> None:
        """Carry out one step and wait until it is over, plus `settle` [s] where the robot comes to rest.

        Raises:
            ComponentError: The plugin refuses.
        """
        reply = self._ask(step.request)
        if not reply.success:
            raise ComponentError(f"'{step.title}' is refused: {reply.message}")
        self.rest(step.title, reply.duration + settle if step.duration is None else step.duration)

    def rest(self, title: str, duration: float) -> None:
        """Watch the robot for `duration` [s] without asking anything."""
        start = self._middleware.now()
        end = start + duration
        while (now := self._middleware.now()) < end and self._middleware.running():
            self._progress(title, now - start, duration)
            self._pass(min(now + 0.05, end))
        if self._middleware.running():
            self._progress(title, duration, duration)

    def _ask(self, request: MoveJoints) -> Reply:
        return self._middleware.call(SERVICE, INTERFACE, request, Reply, timeout=3.0)

    def _pass(self, end: float) -> None:
        self._middleware.sleep_until(end)
        self._recorder.collect()

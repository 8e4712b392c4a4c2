"""The motions of the demonstration, requested from the plugins on upper and lower body (Fig. 4 of the paper)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solfer.components.joint_states import MoveJoints, Reply
from solfer.errors import ComponentError, MiddlewareError
from solfer.transport import Middleware
from solfer_tools.demo.record import MotionRecorder

UPPER = "upper_body"
"""The plugin that moves the upper body."""

LOWER = "lower_body"
"""The plugin that moves the lower body."""


@dataclass
class Show:
    """A demonstration while it runs.

    Attributes:
        middleware: Middleware of simulator and plugins.
        robot: Middleware of what the robot measures and of its commands: in a real-time layer these stay inside.
        output: Folder of pictures and recording.
        started: Time (of `time.monotonic`) at which the user started [s].
        check: Raises if the system has ended.
        waits: Whether the simulation waits for the plugins, however slow they are.
        review: Prints what was measured once everything has ended; gets the recording, and whether a film is drawn, and
            returns the exit code.
    """

    middleware: Middleware
    robot: Middleware
    output: Path
    started: float
    check: Callable[[], None]
    waits: bool = False
    review: Callable[[Path, bool], int] | None = None


@dataclass(frozen=True)
class StoryStep:
    """One motion.

    Attributes:
        title: Name of the motion, for readers.
        requests: Request for each plugin; they move at the same time.
        duration: Duration of the motion [s]; None for the longest that a plugin answers.
    """

    title: str
    requests: Mapping[str, MoveJoints]
    duration: float | None = None


def raised(state: str, upper: Mapping[str, float], speed: float = 0.5) -> list[StoryStep]:
    """Move the lower body to a named state while joints of the upper body move to positions.

    Args:
        state: Named state.
        upper: Positions of joints [rad].
        speed: Largest speed of a joint [rad/s].
    """
    reach = MoveJoints(joints=tuple(upper), positions=tuple(upper.values()), speed=speed)
    return [StoryStep("legs up, torso turns", {UPPER: reach, LOWER: MoveJoints(state=state, speed=speed)})]


def posture(state: str, speed: float = 0.5) -> list[StoryStep]:
    """Move both bodies to a named state with at most `speed` [rad/s]."""
    return [StoryStep("both back", dict.fromkeys((UPPER, LOWER), MoveJoints(state=state, speed=speed)))]


def drive(distance: float, radius: float, forward: dict[str, float], speed: float = 2.5) -> list[StoryStep]:
    """Roll on all wheels in a straight line.

    Args:
        distance: Distance, negative for backwards [m].
        radius: Radius of the wheels [m].
        forward: Sign of the speed of each wheel joint for forward motion.
        speed: Speed of the wheels [rad/s].
    """
    angle = abs(distance) / radius
    acceleration = 3.0  # configured limit of the wheels [rad/s2]
    speed = min(speed, float(np.sqrt(angle * acceleration)))
    joints = tuple(forward)
    velocities = tuple(float(np.sign(distance)) * speed * sign for sign in forward.values())
    direction = "forward" if distance > 0.0 else "back"
    return [
        StoryStep(
            f"{abs(distance):g} m {direction}", {LOWER: MoveJoints(joints=joints, velocities=velocities)}, angle / speed
        ),
        StoryStep("wheels stop", {LOWER: MoveJoints(joints=joints, velocities=(0.0,) * len(joints))}),
    ]


class StoryTeller:
    """Carries out steps and records meanwhile.

    Args:
        middleware: Middleware of the plugins.
        recorder: Recorder of the motion.
        progress: Called with the title, the time since the start of the step and its duration [s].
        plugins: Those that have to accept requests before it begins.
    """

    def __init__(
        self,
        middleware: Middleware,
        recorder: MotionRecorder,
        progress: Callable[[str, float, float], None],
        plugins: tuple[str, ...] = (UPPER, LOWER),
    ):
        self._plugins = plugins
        self._middleware = middleware
        self._recorder = recorder
        self._progress = progress

    def wait_for_robot(self, timeout: float, check: Callable[[], None] = lambda: None) -> None:
        """Wait until the robot is received and commanded, and the plugins accept requests, or the middleware ends.

        Args:
            timeout: Longest wait [s].
            check: Called meanwhile; raises if waiting makes no sense any more.

        Raises:
            MiddlewareError: The robot is not ready within `timeout`.
        """
        end = self._middleware.now() + timeout
        problem = "the robot publishes no joint states"
        while self._middleware.now() < end and self._middleware.running():
            self._pass(self._middleware.now() + 0.1)
            check()
            if self._recorder.newest("measured") is None:
                continue
            problem = self._missing()
            if not problem:
                return
        if self._middleware.running():
            raise MiddlewareError(
                f"not ready within {timeout:g} s: {problem}",
                expected="a machine that is less busy; the log of the nodes says more",
            )

    def publish(self, step: StoryStep, settle: float = 0.3) -> None:
        """Carry out one step and wait until it is over, plus `settle` [s] where the robot comes to rest.

        Raises:
            ComponentError: A plugin refuses.
        """
        longest = 0.0
        for plugin, request in step.requests.items():
            reply = self._request_until_accepted(plugin, request)
            if not reply.success:
                raise ComponentError(f"'{step.title}' is refused by {plugin}: {reply.message}")
            longest = max(longest, reply.duration)
        self.rest(step.title, longest + settle if step.duration is None else step.duration)

    def rest(self, title: str, duration: float) -> None:
        """Record the robot for `duration` [s] without any request."""
        start = self._middleware.now()
        end = start + duration
        while (now := self._middleware.now()) < end and self._middleware.running():
            self._progress(title, now - start, duration)
            self._pass(min(now + 0.05, end))
        if self._middleware.running():
            self._progress(title, duration, duration)

    def _missing(self) -> str:
        """Return why there can be no motion yet; empty if there can."""
        if self._recorder.newest("desired") is None:
            return "no plugin commands the robot"
        try:
            replies = [self._request(plugin, MoveJoints(state="reset")) for plugin in self._plugins]
        except MiddlewareError as error:
            return str(error)
        return "; ".join(reply.message for reply in replies if not reply.success)

    def _request_until_accepted(self, plugin: str, request: MoveJoints) -> Reply:
        """Repeat a request until the plugin agrees, or time is up; return its last reply."""
        end = self._middleware.now() + 3.0  # the machine may have stood still for a moment
        while not (reply := self._request(plugin, request)).success:
            if self._middleware.now() >= end or not self._middleware.running():
                break
            self._pass(self._middleware.now() + 0.1)
        return reply

    def _request(self, plugin: str, request: MoveJoints) -> Reply:
        return self._middleware.call(f"{plugin}/trajectory", "solfer/MoveJoints", request, Reply, timeout=3.0)

    def _pass(self, end: float) -> None:
        self._middleware.sleep_until(end)
        self._recorder.collect()

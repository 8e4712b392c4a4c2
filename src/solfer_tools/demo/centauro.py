"""The demonstration on CENTAURO: upper and lower body move at once, then half a metre forward and back."""

import sys
import time
from collections.abc import Callable
from contextlib import closing

import numpy as np

from solfer.robot import Robot
from solfer.simulation.rendering.renderer import Renderer
from solfer.transport import Middleware
from solfer_tools.demo import report, story
from solfer_tools.demo.record import MotionRecorder, TopicRecorder

LOW = "mammal_wide_straight"
"""Named state with straight legs, in which the robot begins."""

HIGH = "mammal_wide_high"
"""Named state in which the legs have risen."""

INTERRUPTED = 130
"""Exit code of a program that Ctrl-C ended."""


class Progress:
    """One line on the terminal with the present step; a line for each step where there is no terminal."""

    def __init__(self) -> None:
        self._live = sys.stdout.isatty()
        self._open = False

    def __call__(self, title: str, passed: float, duration: float) -> None:
        """Show that `passed` of `duration` [s] of a step are over."""
        fraction = 1.0 if duration <= 0.0 else min(1.0, passed / duration)
        line = f"  {title:<26} [{'#' * round(24 * fraction):<24}] {passed:4.1f} s"
        if self._live:
            print(f"\r{line}", end="\n" if fraction >= 1.0 else "", flush=True)
            self._open = fraction < 1.0
        elif fraction >= 1.0:
            print(line, flush=True)

    def end(self) -> None:
        """End the line of a step that goes on under another title."""
        if self._open:
            print(flush=True)
            self._open = False


def demonstrate(
    show: story.Show,
    steps: Callable[[Robot, MotionRecorder], list[story.StoryStep]],
    plugin: str,
    services: tuple[str, ...],
) -> int:
    """Carry out a story, print the table and draw the pictures; return the exit code.

    Args:
        show: The demonstration.
        steps: Makes the story for a Robot and what has been received of it.
        plugin: The plugin that commands the robot.
        services: Plugins that get the requests.

    Raises:
        SolferError: The robot does not start, or a plugin refuses.
    """
    recorder = MotionRecorder(show.robot)
    storyteller = story.StoryTeller(show.middleware, recorder, Progress(), plugins=services)
    robot = robot_that_stands(show, storyteller, recorder)
    for step in [] if robot is None else steps(robot, recorder):
        show.check()
        storyteller.publish(step)
        if not show.middleware.running():
            break
    if robot is None or not show.middleware.running():
        return INTERRUPTED
    storyteller.rest("stands", 1.0)
    return conclude(show, robot, recorder, plugin=plugin)


def robot_that_stands(show: story.Show, storyteller: story.StoryTeller, recorder: MotionRecorder) -> Robot | None:
    """Wait until the robot stands, and return it at its measured posture; None: the middleware has ended.

    Raises:
        MiddlewareError: The robot does not start.
    """
    storyteller.wait_for_robot(60.0, show.check)
    return placed_robot(show.middleware, recorder, show.started) if show.middleware.running() else None


def placed_robot(middleware: Middleware, recorder: TopicRecorder, started: float) -> Robot:
    """Report that the robot stands, and build it at its measured posture."""
    print(f"CENTAURO stands; first motion {time.monotonic() - started:.1f} s after the start", flush=True)
    robot = load_robot(middleware)
    robot.state.position[:] = posture(robot, recorder)
    robot.update()
    return robot


def steps_of(robot: Robot, recorder: MotionRecorder) -> list[story.StoryStep]:
    """Return the story: legs rise while the torso turns, both go back, and the robot drives there and back."""
    forward, radius = wheels(robot, recorder)
    distance = 0.5  # [m]
    return [
        *story.raised(HIGH, {"torso_yaw": 0.4, "j_arm1_4": -1.6, "j_arm2_4": -1.6}),
        *story.posture(LOW),
        *story.drive(distance, radius, forward),
        *story.drive(-distance, radius, forward),
    ]


def conclude(show: story.Show, robot: Robot, recorder: MotionRecorder, plugin: str) -> int:
    """Print the table and draw the pictures of a story that is over; return the exit code."""
    forward, _ = wheels(robot, recorder)
    show.output.mkdir(parents=True, exist_ok=True)
    picture = show.output / "demo.png"
    tracking = show.output / "demo_tracking.png"
    with closing(Renderer(robot.description, robot.kinematics)) as renderer:
        renderer.save(posture(robot, recorder), picture)
    drawn = ("torso_yaw", "j_arm1_4", "hip_pitch_1", "ankle_pitch_1")
    report.plot(recorder, drawn, tuple(forward), path=tracking)
    print(
        report.format_table(
            report.table(recorder, parts(robot), show.middleware.reports(), plugin=plugin, simulator="simulation")
        )
    )
    print(f"pictures: {picture}, {tracking}")
    return 0


def load_robot(middleware: Middleware) -> Robot:
    """Build the robot from the parameters that the launch file fills."""
    return Robot.load(middleware.parameter("/robot_description"), middleware.parameter("/robot_semantic_description"))


def parts(robot: Robot) -> dict[str, set[str]]:
    """Return the joints of the upper and the lower body."""
    lower = {joint for joint in robot.semantics.groups["lower_body"].joints if joint in robot.dofs}
    return {"upper body": set(robot.dofs) - lower, "lower body": lower}


def posture(robot: Robot, recorder: TopicRecorder) -> np.ndarray:
    """Return the robot's DoFs as they were measured last, shape (n,)."""
    position = np.zeros(robot.size)
    joints = recorder.newest("measured")
    base = recorder.newest("base")
    for name, value in zip(joints.names, joints.position, strict=True):
        position[robot.dof(name)] = value
    robot.kinematics.base.from_pose(base.position, base.orientation, position[:6])
    return position


def wheels(robot: Robot, recorder: MotionRecorder) -> tuple[dict[str, float], float]:
    """Compute the sign of each wheel joint's speed for forward motion, and the wheels' radius [m].

    The sign holds for the present posture: a wheel rolls forward when it turns about the world's y axis.
    """
    robot.state.position[:] = posture(robot, recorder)
    robot.update()
    group = robot.semantics.groups["wheels"]
    forward = {}
    for joint in group.joints:
        link = robot.description.joints[joint].child
        axis = robot.kinematics.jacobian(link)[3:, robot.dof(joint)]
        forward[joint] = float(np.sign(axis[1]))
    height = min(robot.kinematics.position(robot.description.joints[joint].child)[2] for joint in group.joints)
    return forward, float(height)

"""The demonstration on CENTAURO: upper and lower body move at once, then half a metre forward and back."""

import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np

from solfer.demo import report, story
from solfer.demo.record import MotionRecorder
from solfer.robot import Robot
from solfer.simulation.rendering.renderer import Renderer
from solfer.transport import Middleware

LOW, HIGH = "mammal_wide_straight", "mammal_wide_high"
DISTANCE = 0.5
"""Distance that the robot drives [m]."""

REACH = {"torso_yaw": 0.4, "j_arm1_4": -1.6, "j_arm2_4": -1.6}
"""Goal of the upper body while the legs rise [rad]."""

DRAWN = ("torso_yaw", "j_arm1_4", "hip_pitch_1", "ankle_pitch_1")
"""Joints whose tracking is drawn."""

PLUGIN, SIMULATOR = "whole_body", "simulation"
"""Names of the health reports."""

INTERRUPTED = 130
"""Exit code of a program that Ctrl-C ended."""


class Progress:
    """One line on the terminal with the present step; a line for each step where there is no terminal."""

    def __init__(self) -> None:
        self._live = sys.stdout.isatty()
        self._title = ""

    def __call__(self, title: str, passed: float, duration: float) -> None:
        """Show that `passed` of `duration` [s] of a step are over."""
        part = 1.0 if duration <= 0.0 else min(1.0, passed / duration)
        line = f"  {title:<24} [{'#' * round(24 * part):<24}] {passed:4.1f} s"
        if self._live:
            print(f"\r{line}", end="\n" if part >= 1.0 else "", flush=True)
        elif part >= 1.0:
            print(line, flush=True)


def show(middleware: Middleware, output: Path, started: float, check: Callable[[], None]) -> int:
    """Carry out the story, print the table and draw the pictures; return the exit code.

    Args:
        middleware: Middleware of simulator and plugins.
        output: Folder of the pictures; made if missing.
        started: Time (of `time.monotonic`) at which the user started [s].
        check: Raises if the system has ended.

    Raises:
        SolferError: The robot does not start, or a plugin refuses.
    """
    middleware.reports()
    recorder = MotionRecorder(middleware)
    storyteller = story.StoryTeller(middleware, recorder, Progress())
    storyteller.wait_for_robot(30.0, check)
    if not middleware.running():
        return INTERRUPTED
    print(f"CENTAURO stands; first motion {time.monotonic() - started:.1f} s after the start")
    robot = load_robot(middleware)
    forward, radius = wheels(robot, recorder)
    steps = [
        *story.raised(HIGH, REACH),
        *story.posture(LOW),
        *story.drive(DISTANCE, radius, forward),
        *story.drive(-DISTANCE, radius, forward),
    ]
    for step in steps:
        check()
        storyteller.publish(step)
        if not middleware.running():
            return INTERRUPTED
    storyteller.rest("stands", 1.0)
    output.mkdir(parents=True, exist_ok=True)
    with closing(Renderer(robot.description, robot.kinematics)) as renderer:
        renderer.save(posture(robot, recorder), output / "demo.png")
    report.plot(recorder, DRAWN, tuple(forward), output / "demo_tracking.png")
    print(report.format_table(report.table(recorder, parts(robot), middleware.reports(), PLUGIN, SIMULATOR)))
    print(f"pictures: {output / 'demo.png'}, {output / 'demo_tracking.png'}")
    return 0


def load_robot(middleware: Middleware) -> Robot:
    """Build the robot from the parameters that the launch file fills."""
    return Robot.load(middleware.parameter("/robot_description"), middleware.parameter("/robot_semantic_description"))


def parts(robot: Robot) -> dict[str, set[str]]:
    """Return the joints of the upper and the lower body."""
    lower = {joint for joint in robot.semantics.groups["lower_body"].joints if joint in robot.dofs}
    return {"upper body": set(robot.dofs) - lower, "lower body": lower}


def posture(robot: Robot, recorder: MotionRecorder) -> np.ndarray:
    """Return the robot's DoFs as they were measured last, shape (n,)."""
    position = np.zeros(robot.size)
    joints, base = recorder.newest("measured"), recorder.newest("base")
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

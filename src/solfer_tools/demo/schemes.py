"""Schemes of the demonstration, figures of the paper and squats: launch files, and the requests to the robot."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from solfer.components.move_joints import MoveJoints
from solfer.robot import Robot
from solfer_tools.demo import centauro, driving, review, story
from solfer_tools.demo.driving_record import DrivingRecorder
from solfer_tools.demo.record import MotionRecorder
from solfer_tools.demo.waving import Waving, hands_of, robot_time


@dataclass(frozen=True)
class Scheme:
    """A scheme of the paper, or another one.

    Attributes:
        title: What it is, for people.
        launch: Its launch file.
        run: Carries it out; returns the exit code.
        arguments: Arguments of the launch file.
    """

    title: str
    launch: str
    run: Callable[[story.Show], int]
    arguments: Mapping[str, str] = field(default_factory=dict)


def drive(show: story.Show) -> int:
    """Fig. 5: drive along the course while both hands wave."""
    recorder = DrivingRecorder(show.middleware)
    begin = driving.wait_for_robot(show.middleware, recorder, show.started, check=show.check)
    if begin is None:
        return centauro.INTERRUPTED
    code = begin.run(centauro.Progress(), show.check)
    found = review.DrivingFindings(
        begin.robot, begin.legs, recorder, reports=show.middleware.reports(), taken=begin.taken, waited=show.waits
    )
    show.review = lambda file, films: review.present(found, file, show.output, films=films)
    return code


def wave(show: story.Show) -> int:
    """Fig. 2: both hands wave."""

    def waving(robot: Robot) -> Callable[[float], None]:
        return Waving(show.middleware, "manipulation", hands_of(robot)).send

    return watch(show, "manipulation", "both hands wave", duration=10.0, actor=waving)


def squat(show: story.Show) -> int:
    """Squat on torques: no request is sent, the configuration generates the reference."""
    # three times
    return watch(show, "squat", "it squats", duration=12.0, actor=lambda _: lambda _: None)


def watch(
    show: story.Show,
    plugin: str,
    title: str,
    duration: float,
    actor: Callable[[Robot], Callable[[float], None]],
) -> int:
    """Let a plugin work for `duration` [s], print the table and draw the pictures; return the exit code.

    `actor` makes of the Robot what is called with the time that has passed [s].
    """
    middleware = show.middleware
    recorder = MotionRecorder(show.robot)
    progress = centauro.Progress()
    teller = story.StoryTeller(middleware, recorder, progress, plugins=())
    robot = centauro.robot_that_stands(show, teller, recorder)
    if robot is None:
        return centauro.INTERRUPTED
    act = actor(robot)
    begin = robot_time(recorder)
    passed = 0.0
    while middleware.running() and passed < duration:
        passed = robot_time(recorder) - begin
        act(passed)
        progress(title, passed, duration)
        show.check()
        recorder.collect()
        middleware.sleep_until(middleware.now() + 0.02)
    return centauro.conclude(show, robot, recorder, plugin=plugin) if middleware.running() else centauro.INTERRUPTED


def carry(show: story.Show) -> int:
    """Fig. 3: one plugin generates desired joint positions, another one moves the robot there by torques."""
    desired = "desired_joints"
    steps = [
        story.StoryStep("legs up", {desired: MoveJoints(state=centauro.HIGH, speed=0.5)}),
        story.StoryStep("legs down", {desired: MoveJoints(state=centauro.LOW, speed=0.5)}),
    ]
    return centauro.demonstrate(show, lambda *_: steps, "gravity_compensation", services=(desired,))


def joints(plugin: str) -> Callable[[story.Show], int]:
    """Fig. 4: upper and lower body move at once; `plugin` merges what is desired."""
    return lambda show: centauro.demonstrate(show, centauro.steps_of, plugin, services=(story.UPPER, story.LOWER))


JOINTS = {"motion": "joints"}
"""Argument of launch files whose figures have tasks in the paper: the demonstration moves joints instead."""

SCHEMES = {
    "fig2": Scheme("Fig. 2, manipulation of the upper body", "figure_2.launch", wave),
    "fig3": Scheme("Fig. 3, a robot that is carried by torques", "figure_3.launch", carry, arguments=JOINTS),
    "fig4": Scheme("Fig. 4, shared control", "figure_4.launch", joints("shared_compensation"), arguments=JOINTS),
    "fig5": Scheme("Fig. 5, the full control scheme", "figure_5.launch", drive, arguments={"world": "gate"}),
    "squat": Scheme("Inverse dynamics, squats on torques", "inverse_dynamics.launch", squat),
}
"""The schemes, by their names on the command line."""

WITHOUT_TORQUES = Scheme(
    "Fig. 4 without torques", "figure_4.launch", joints("whole_body"), arguments={**JOINTS, "merging": "whole_body"}
)

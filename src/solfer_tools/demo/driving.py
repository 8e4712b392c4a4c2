"""The demonstration of Fig. 5: CENTAURO drives through a gate and along a circle while both hands wave."""

import time
from collections.abc import Callable
from pathlib import Path

from solfer.config.yaml.files import located
from solfer.errors import MiddlewareError
from solfer.robot import Robot
from solfer.transport import Middleware
from solfer.transport.fixed_rate import FixedRateLoop
from solfer.transport.health import Health
from solfer.transport.plugin_state import SAFE_STOP
from solfer_tools.demo.centauro import INTERRUPTED, Progress, placed_robot
from solfer_tools.demo.driving_record import DrivingRecorder
from solfer_tools.demo.waving import Waving, hands_of, robot_time
from solfer_tools.navigation import Navigation, ScenarioCourse
from solfer_tools.scenarios import Player, read_scenario

COURSE_RATE = 50.0
"""Of navigation and of what waves [Hz]."""


class RealTimeLost(MiddlewareError):
    """A real-time layer has stopped the robot safely: its cycles took too long for this machine."""


class ErrorWatch:
    """Ends a demonstration whose robot does not work any more.

    Args:
        middleware: Where nodes report how they are.
    """

    def __init__(self, middleware: Middleware):
        self._middleware = middleware
        self._since: dict[str, float] = {}

    def check(self) -> None:
        """Look at all reports; to be called several times a second.

        Raises:
            RealTimeLost: The layer has stopped the robot.
            MiddlewareError: One has been an error for long.
        """
        now = self._middleware.now()
        reports = {name: report for name, report in self._middleware.reports().items() if report.level is Health.ERROR}
        self._since = {name: self._since.get(name, now) for name in reports}
        for name, since in self._since.items():
            if now - since <= 5.0:  # a node may recover
                continue
            if SAFE_STOP in reports[name].summary:
                raise RealTimeLost(
                    f"{name}: {reports[name].summary}",
                    expected="a machine that is less busy, or `--middleware ROS --lockstep`",
                )
            raise MiddlewareError(
                f"{name}: {reports[name].summary}",
                expected="a machine that is less busy, or --lockstep; the log of the nodes says more",
            )


class Driving:
    """Third parties of Fig. 5: navigation, and the publisher of the hands' references.

    Args:
        middleware: Middleware of robot and plugins.
        recorder: Sees what happens.
        robot: The Robot, at the measured posture.
        legs: The Robot that `locomotion` works on.
        course: File of the scenario.

    Attributes:
        robot: The Robot.
        legs: As above.
        taken: How long the course took [s].
    """

    def __init__(self, middleware: Middleware, recorder: DrivingRecorder, robot: Robot, legs: Robot, course: Path):
        self._middleware = middleware
        self._recorder = recorder
        self.taken = 0.0
        self.robot = robot
        self.legs = legs
        self._player = Player(read_scenario(course), 1.0 / COURSE_RATE)

    def run(self, progress: Progress, check: Callable[[], None] = lambda: None) -> int:
        """Drive to the end of the course; return the exit code.

        Args:
            progress: Shows how far it is.
            check: Raises if the system has ended.
        """
        middleware = self._middleware
        course = ScenarioCourse(middleware, self._player, "locomotion", odometry="odometry/odom", positions=True)
        navigation = Navigation(middleware, course, "navigation", rate=COURSE_RATE)
        waving = Waving(middleware, "hands", hands_of(self.robot))
        begin = middleware.now()
        whole = course.left
        cycles = 0
        shown = ""
        robot_begin = robot_time(self._recorder)
        errors = ErrorWatch(middleware)
        titles = {
            2: "drives, becomes narrower",
            3: "through the gate",
            4: "becomes wider",
            5: "along a circle",
            6: "stands",
        }

        def cycle(_: float, skipped: int) -> None:
            nonlocal cycles, shown
            navigation.cycle(skipped)
            waving.send(robot_time(self._recorder) - robot_begin)
            self._recorder.collect()
            if cycles % 10 == 0:
                check()
                errors.check()
                title = f"waits for {navigation.waits}" if navigation.waits else titles.get(course.number, course.name)
                if title != shown:
                    progress.end()
                    shown = title
                progress(title, min(whole - course.left, 0.999 * whole), whole)
            cycles += 1

        try:
            FixedRateLoop(middleware, COURSE_RATE).run(cycle, lambda: middleware.running() and not navigation.done)
        finally:
            self._rest(course)
        self.taken = middleware.now() - begin
        if not navigation.done:
            progress.end()
            return INTERRUPTED
        progress("stands", whole, whole)
        return 0

    def _rest(self, course: ScenarioCourse) -> None:
        """Let the robot come to rest, as far as it does so soon."""
        now = self._middleware.now
        end = now() + 3.0
        latest = time.monotonic() + 20.0  # simulated time may pass slowly, or stand still
        looks = 0
        # of many messages: a body that rocks rolls the wheels to and fro, and they stand for a moment between
        while now() < end and time.monotonic() < latest and (looks < 5 or self._recorder.fastest_wheel(20) >= 0.05):
            course.rest()
            time.sleep(1.0 / COURSE_RATE)
            self._recorder.collect()
            looks += 1


def wait_for_robot(
    middleware: Middleware, recorder: DrivingRecorder, started: float, check: Callable[[], None], timeout: float = 60.0
) -> Driving | None:
    """Wait until the robot is received, commanded and located; report what it waits for. None if the middleware ends.

    Args:
        middleware: Middleware of simulator and plugins.
        recorder: Sees what happens.
        started: Time (of `time.monotonic`) at which the user started [s].
        check: Raises if the system has ended.
        timeout: Longest wait, in real time [s].

    Raises:
        MiddlewareError: It takes longer.
    """
    end = time.monotonic() + timeout
    shown = ""
    while middleware.running() and (missing := recorder.missing()):
        if missing != shown:
            print(f"waits for {missing}", flush=True)
            shown = missing
        if time.monotonic() > end:
            raise MiddlewareError(
                f"not ready within {timeout:g} s: nothing came of {missing}",
                expected="a machine that is less busy; the log of the nodes says more",
            )
        check()
        time.sleep(0.05)
        recorder.collect()
    if not middleware.running():
        return None
    robot = placed_robot(middleware, recorder, started)
    legs = Robot.load(middleware.parameter("/robot_lower_body"))
    course = located("package://solfer/config/figures/course.yaml", ".")
    return Driving(middleware, recorder, robot, legs=legs, course=course)

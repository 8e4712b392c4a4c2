"""Shows a page in the browser."""

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from solfer.errors import RecordingError
from solfer.robot import Robot
from solfer.robot.description.shipped import robot_of
from solfer.transport import Middleware
from solfer.transport.fixed_rate import FixedRateLoop
from solfer_tools.cli.view.paced import PacedClock
from solfer_tools.scene import LiveScene, SceneState
from solfer_tools.view import Page, PageServer, Playback

ROBOT = "centauro"
NODE = "view"

RATE = 20.0
"""Pictures a second [Hz]."""


@dataclass(frozen=True)
class ShownSource:
    """What is shown.

    Attributes:
        robot: The robot, for the scene alone.
        middleware: Carries its topics.
        stop: The emergency stop; None: the service of the lower level.
        playback: The recording; None: it is live.
        pace: Its pace in memory; None: others set it.
        beside: The scene of the recording beside it; None: there is none.
    """

    robot: Robot
    middleware: Middleware
    stop: Callable[[], None] | None = None
    playback: Playback | None = None
    pace: PacedClock | None = None
    beside: LiveScene | None = None


def show(options: argparse.Namespace) -> int:
    """Show the page until the source or the user ends it."""
    with suppress(KeyboardInterrupt), _opened(options) as source, closing(PageServer(int(options.port))) as server:
        scene = LiveScene(source.robot, source.middleware)
        page = Page(
            server,
            source.robot.description,
            source.middleware,
            stop=source.stop,
            control=options.control,
            playback=source.playback,
            simulation=None if source.playback is not None else source.pace,
        )
        if options.foxglove:
            page.serve_foxglove(server)
        print(server.address, flush=True)  # after errors of the source
        if page.foxglove is not None:
            print(page.foxglove.address, flush=True)
        loop = FixedRateLoop(source.pace or source.middleware, RATE)
        loop.run(lambda *_: page.update(_picture(scene, source.beside)), source.middleware.running)
    return 0


def _picture(scene: LiveScene, beside: LiveScene | None) -> SceneState | None:
    """Return a scene, with the robot of another one in place of the desired robot."""
    state = scene.update()
    other = None if beside is None else beside.update()
    return state if state is None or other is None else replace(state, desired=other.measured)


@contextmanager
def _opened(options: argparse.Namespace) -> Iterator[ShownSource]:
    """Open what is shown."""
    with ExitStack() as stack:
        if options.file is not None:
            yield _recording(options)
        elif options.study is not None:
            yield _simulation(options, stack)
        else:
            source = _ros(options) if options.namespace is None else _layer(options)
            stack.enter_context(closing(source.middleware))
            yield source


def _named(name: str) -> Robot:
    """Load a robot of this package, or that of a bundle."""
    name, files = robot_of(name)
    return Robot.load(files.urdf, files.srdf, files.floating_base, name=name, contacts=files.contacts)


def _recording(options: argparse.Namespace) -> ShownSource:
    from solfer.middleware.memory import Bus, MemoryMiddleware
    from solfer.recording.reading.pieces import RecordingPieces
    from solfer_tools.view.playback import robot_of_recording

    def played(file: Path, bus: Bus) -> tuple[Robot, Playback]:
        pieces = RecordingPieces(file)
        robot = robot_of_recording(pieces) if options.robot is None else _named(options.robot)
        return robot, Playback(pieces, MemoryMiddleware(bus, "recording"), robot)

    bus = Bus()
    robot, playback = played(options.file, bus)
    beside = None
    if options.beside is not None:
        others = Bus()
        other_robot, other = played(options.beside, others)
        if other_robot.description.links.keys() != robot.description.links.keys():
            raise RecordingError(
                "it has a robot of other links", where=str(options.beside), expected=f"one of {robot.name}"
            )
        other.plays = False
        beside = LiveScene(other_robot, MemoryMiddleware(others, NODE))

    def step(duration: float) -> None:
        bus.run_until(bus.time + duration)
        playback.advance(duration)
        if beside is not None:
            others.run_until(bus.time)
            other.seek(other.begin + playback.time - playback.begin)
            other.advance(duration)

    pace = PacedClock(step, 1.0 / RATE, bus.call)
    return ShownSource(robot, MemoryMiddleware(bus, NODE), playback=playback, pace=pace, beside=beside)


def _simulation(options: argparse.Namespace, stack: ExitStack) -> ShownSource:
    from solfer_tools.study import SimulatedRun, read_study

    record = read_study(options.study).record
    run = stack.enter_context(SimulatedRun(record))
    run.attend()
    robot = _named(options.robot or record.simulation.robot)
    return ShownSource(robot, run.node(NODE), pace=PacedClock(run.step, 1.0 / RATE, run.bus.call))


def _layer(options: argparse.Namespace) -> ShownSource:
    from solfer.realtime.emergency_stop import EmergencyStopLatch
    from solfer.realtime.namespaces import find
    from solfer_tools.cli.view.layer import LayerMiddleware

    namespace = find(options.namespace)
    latch = EmergencyStopLatch(namespace.folder)
    stop = partial(latch.trip, "by the page")
    return ShownSource(_named(options.robot or ROBOT), LayerMiddleware(namespace, NODE), stop)


def _ros(options: argparse.Namespace) -> ShownSource:
    from solfer.middleware.ros import RosMiddleware, RosNode

    robot = _named(options.robot or ROBOT)  # before the master is called
    return ShownSource(robot, RosMiddleware(RosNode(NODE, sys.argv)))

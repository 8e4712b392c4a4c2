"""Shows a page in the browser."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress

from solfer.cli.view.paced import PacedMiddleware
from solfer.robot import Robot
from solfer.robot.shipped import robot_of
from solfer.scene import LiveScene
from solfer.transport import Middleware
from solfer.transport.fixed_rate import FixedRateLoop
from solfer.view import Page, PageServer

RATE = 20.0
"""Of the page [Hz]."""

ROBOT = "centauro"
NAME = "view"


def show(options: argparse.Namespace) -> int:
    """Show the page until the source or the user ends it."""
    with closing(PageServer(int(options.port))) as server:
        print(server.address, flush=True)
        with _source(options) as (name, middleware), suppress(KeyboardInterrupt):
            robot = load_robot(name)
            scene, page = LiveScene(robot, middleware), Page(server, robot.description)
            FixedRateLoop(middleware, RATE).run(lambda *_: page.update(scene.update()), middleware.running)
    return 0


def load_robot(name: str) -> Robot:
    """Load a robot of this package, or that of a bundle."""
    name, files = robot_of(name)
    return Robot.load(files.urdf, files.srdf, files.floating_base, name=name, contacts=files.contacts)


@contextmanager
def _source(options: argparse.Namespace) -> Iterator[tuple[str, Middleware]]:
    """Open what is shown: the robot's name, and what carries its topics."""
    robot = options.robot or ROBOT
    if options.study is not None:
        from solfer.study import SimulatedRun, read_study

        record = read_study(options.study).record
        with SimulatedRun(record) as run:
            yield options.robot or record.simulation.robot, PacedMiddleware(run.bus, NAME, run.step)
        return
    middleware = _layer(options.namespace) if options.namespace is not None else _ros(robot)
    with closing(middleware):
        yield robot, middleware


def _layer(name: str) -> Middleware:
    from solfer.middleware.shared_memory.middleware import XbotMiddleware
    from solfer.realtime.namespaces import find

    return XbotMiddleware(find(name), NAME, listens=False)


def _ros(robot: str) -> Middleware:
    from solfer.middleware.ros import RosMiddleware, RosNode

    robot_of(robot)  # before the master is called
    return RosMiddleware(RosNode(NAME, sys.argv))

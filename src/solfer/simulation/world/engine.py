"""One PyBullet world: the only place that imports PyBullet."""

import contextlib
import ctypes
import locale
import os
import sys
from collections.abc import Iterable, Iterator
from types import ModuleType

from solfer.errors import MissingDependency, SimulationError

STEP = 0.001  # [s]
GRAVITY = 9.81  # [m/s^2], along -z
SOLVER_ITERATIONS = 50
STDOUT = 1
STDERR_DESCRIPTOR = 2  # file descriptors
WINDOW_VIEW = (2.5, 50.0, -20.0)
"""Distance [m], yaw and pitch [deg] of the window's camera at first."""


@contextlib.contextmanager
def redirected(descriptors: tuple[int, ...], target: int | None = None) -> Iterator[None]:
    """Send what C code prints on `descriptors` to the descriptor `target`; None: it is lost.

    PyBullet greets on stdout, which may be read by a machine.
    """
    libc = ctypes.CDLL(None)
    sys.stdout.flush()
    libc.fflush(None)
    kept = [os.dup(descriptor) for descriptor in descriptors]
    sink = os.open(os.devnull, os.O_WRONLY) if target is None else os.dup(target)
    try:
        for descriptor in descriptors:
            os.dup2(sink, descriptor)
        yield
    finally:
        libc.fflush(None)
        for descriptor, copy in zip(descriptors, kept, strict=True):
            os.dup2(copy, descriptor)
            os.close(copy)
        os.close(sink)


@contextlib.contextmanager
def decimal_points() -> Iterator[None]:
    """Let C code read numbers with a point, also where the locale has decimal commas; PyBullet reads by the locale."""
    before = locale.setlocale(locale.LC_NUMERIC)
    locale.setlocale(locale.LC_NUMERIC, "C")
    try:
        yield
    finally:
        locale.setlocale(locale.LC_NUMERIC, before)


def load_pybullet() -> ModuleType:
    """Import the module pybullet.

    Raises:
        MissingDependency: It is not installed.
    """
    with redirected((STDOUT, STDERR_DESCRIPTOR)):
        try:
            import pybullet
        except ModuleNotFoundError as error:
            raise MissingDependency(
                "the simulation needs PyBullet",
                expected="pip install pybullet; from Python 3.12 on that compiles it, with g++ and python3-dev",
            ) from error
    return pybullet


class Engine:
    """A client of PyBullet with gravity and a fixed step.

    Args:
        gui: Open PyBullet's window instead of working without one.

    Attributes:
        bullet: The module pybullet.
        client: Number of the client, the last argument of all calls.

    Raises:
        MissingDependency: PyBullet is not installed.
        SimulationError: The world cannot be opened.
    """

    def __init__(self, gui: bool = False):
        self.bullet = load_pybullet()
        if gui and not os.environ.get("DISPLAY"):
            raise SimulationError("PyBullet's window needs a display", expected="DISPLAY to be set, or no window")
        with redirected((STDOUT,)):
            self.client = self.bullet.connect(self.bullet.GUI if gui else self.bullet.DIRECT)
        if self.client < 0:
            raise SimulationError(
                "PyBullet does not connect", expected="a display for the window, or a simulation without one"
            )
        self._window = gui
        if gui:  # its panels show nothing of use, and drawing while a robot is loaded takes a minute without a GPU
            for flag in (self.bullet.COV_ENABLE_GUI, self.bullet.COV_ENABLE_RENDERING):
                self.bullet.configureDebugVisualizer(flag, 0, physicsClientId=self.client)
        self.bullet.setGravity(0.0, 0.0, -GRAVITY, self.client)
        self.bullet.setPhysicsEngineParameter(
            fixedTimeStep=STEP,
            numSubSteps=0,
            numSolverIterations=SOLVER_ITERATIONS,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )

    def show(self, target: Iterable[float]) -> None:
        """Begin to draw, with the camera on the point `target` [m]; no effect without a window."""
        if self._window:
            self.bullet.resetDebugVisualizerCamera(*WINDOW_VIEW, [float(value) for value in target], self.client)
            self.bullet.configureDebugVisualizer(self.bullet.COV_ENABLE_RENDERING, 1, physicsClientId=self.client)

    def step(self) -> None:
        """Advance by STEP."""
        self.bullet.stepSimulation(self.client)

    def forget_contacts(self) -> None:
        """End the contacts of bodies that are not near each other any more.

        Bullet keeps the points and impulses of a contact for the next step, also when a body was put elsewhere and
        came back in between.
        """
        self.bullet.performCollisionDetection(self.client)

    def keep(self) -> int:
        """Save where all bodies are, how they move and what touches; for `bring_back` and `forget`."""
        return self.bullet.saveState(self.client)

    def bring_back(self, kept: int) -> None:
        """Restore what was saved, even if values have become infinite since; no body may have come or gone."""
        self.bullet.restoreState(kept, physicsClientId=self.client)

    def forget(self, kept: int) -> None:
        """Drop what was saved."""
        self.bullet.removeState(kept, self.client)

    def close(self) -> None:
        """Disconnect; the engine is unusable afterwards. May be called twice."""
        if self.client >= 0:
            self.bullet.disconnect(self.client)
            self.client = -1

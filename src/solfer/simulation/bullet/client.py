"""A client of PyBullet: the only place that imports it."""

import contextlib
import ctypes
import locale
import os
import sys
from collections.abc import Iterator
from functools import partial
from inspect import isbuiltin
from types import ModuleType, SimpleNamespace
from typing import Any

from solfer.errors import MissingDependency, SimulationError
from solfer.installation import pip_install

STDOUT = 1
"""File descriptor."""

STDERR = 2
"""File descriptor."""


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
    with redirected((STDOUT, STDERR)):
        try:
            import pybullet
        except ModuleNotFoundError as error:
            raise MissingDependency(
                "the simulation needs PyBullet",
                expected=f"{pip_install('pybullet')}, up to Python 3.11; on later ones MuJoCo",
            ) from error
    return pybullet


class BulletClient:
    """A world of PyBullet, empty at first.

    Args:
        gui: Open PyBullet's window instead of working without one.

    Attributes:
        bullet: The module pybullet, whose functions get the number of this client.
        number: Number of the client; negative: it is disconnected.

    Raises:
        MissingDependency: PyBullet is not installed.
        SimulationError: The world cannot be opened.
    """

    def __init__(self, gui: bool = False):
        bullet = load_pybullet()
        if gui and not os.environ.get("DISPLAY"):
            raise SimulationError("PyBullet's window needs a display", expected="DISPLAY to be set, or no window")
        with redirected((STDOUT,)):
            self.number = bullet.connect(bullet.GUI if gui else bullet.DIRECT)
        if self.number < 0:
            raise SimulationError(
                "PyBullet does not connect", expected="a display for the window, or a simulation without one"
            )
        # as pybullet_utils does it, but once, and not in each call
        bound = {
            name: partial(each, physicsClientId=self.number)
            for name, each in vars(bullet).items()
            if isbuiltin(each) and not name.startswith("compute")
        }
        self.bullet: Any = SimpleNamespace(**{**vars(bullet), **bound})

    def close(self) -> None:
        """Disconnect. May be called twice."""
        if self.number >= 0:
            self.bullet.disconnect()
            self.number = -1

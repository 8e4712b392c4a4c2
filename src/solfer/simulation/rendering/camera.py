"""Pictures of a running simulation, drawn by another process: PyBullet holds Python's lock while it draws."""

import contextlib
import functools
import os
import pickle
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from solfer.errors import SimulationError, SolferError
from solfer.model.kinematics import Kinematics
from solfer.model.urdf.description import Description
from solfer.simulation.rendering.pictures import write_picture
from solfer.simulation.rendering.renderer import Renderer
from solfer.simulation.world.records import WorldRecord
from solfer.simulation.world.world import Pose


@dataclass(frozen=True)
class Scene:
    """What does not change from picture to picture."""

    urdf: str
    where: str
    floating: bool
    world: WorldRecord


@dataclass(frozen=True)
class Shot:
    """One picture: positions of the model's DoFs, poses of the boxes that move, and the file that is written."""

    q: np.ndarray
    boxes: list[Pose]
    path: Path


class Camera:
    """Draws pictures in a child process that starts with the first one.

    Args:
        scene: What is drawn.
    """

    def __init__(self, scene: Scene):
        self._scene = scene
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None

    def take(self, shot: Shot) -> None:
        """Draw a picture; blocks until the file is there, but lets other threads run.

        Raises:
            SimulationError: The file cannot be written; see `write_picture`.
        """
        with self._lock:
            try:
                if self._process is None or self._process.poll() is not None:
                    self._start()
                pickle.dump(shot, self._process.stdin)
                self._process.stdin.flush()
                reason = pickle.load(self._process.stdout)
            except (OSError, EOFError) as error:
                raise SimulationError(
                    "the process that draws pictures has ended",
                    expected="a process that draws until the simulation ends; the next picture starts another one",
                ) from error
        if reason:
            raise SimulationError(reason)

    def close(self) -> None:
        """End the child process. May be called twice."""
        process = self._process
        self._process = None
        if process is None:
            return
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()

    def _start(self) -> None:
        # a session of its own: Ctrl-C is for the simulator, which ends this process when it is done
        self._process = subprocess.Popen(
            [sys.executable, "-c", f"from {__name__} import draw_all; draw_all()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        pickle.dump(self._scene, self._process.stdin)


def draw_all() -> None:
    """Draw what comes on stdin until it ends; each answer on stdout is an error, or nothing."""
    os.nice(10)  # the simulation goes before its pictures
    source = sys.stdin.buffer
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    scene = pickle.load(source)
    description = Description.from_text(scene.urdf, scene.where)
    renderer = Renderer(description, Kinematics(description, scene.floating), world=scene.world)
    while True:
        try:
            shot = pickle.load(source)
        except EOFError:
            break
        reason = ""
        try:
            write_picture(shot.path, functools.partial(_draw, renderer, shot))
        except SolferError as error:
            reason = str(error)
        pickle.dump(reason, answers)
        answers.flush()
    renderer.close()


def _draw(renderer: Renderer, shot: Shot, file: BinaryIO) -> None:
    renderer.write(shot.q, file, shot.boxes)

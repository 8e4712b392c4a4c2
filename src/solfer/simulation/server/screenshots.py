"""Pictures of a simulation, drawn beside its steps."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeout
from pathlib import Path
from typing import Any

from solfer.errors import SimulationError
from solfer.simulation.rendering.camera import Camera, Scene, Shot
from solfer.simulation.rendering.pictures import Pictures
from solfer.simulation.simulation import Simulation
from solfer.transport import Inbox


class Screenshots:
    """Draws pictures in a thread, with a process of its own, while the simulation goes on.

    Args:
        simulation: The simulation.
        inbox: Calls that are carried out between two steps.
        pictures: Where pictures are written.
    """

    def __init__(self, simulation: Simulation, inbox: Inbox, pictures: Pictures):
        description = simulation.kinematics.description
        scene = Scene(description.text, description.where, simulation.floating, world=simulation.world.record)
        self._simulation = simulation
        self._inbox = inbox
        self._camera = Camera(scene)
        self._pictures = pictures
        self._thread = ThreadPoolExecutor(1)
        self._drawings: list[Future[Any]] = []

    def submit(self, call: Callable[[], Any]) -> "Future[Any]":
        """Pass a call to the thread that draws, unless too many wait there."""
        self._drawings = [drawing for drawing in self._drawings if not drawing.done()]
        if len(self._drawings) < 4:
            self._drawings.append(self._thread.submit(call))
            return self._drawings[-1]
        refused: Future[Any] = Future()
        refused.set_exception(SimulationError("4 pictures wait to be drawn", expected="a request later on"))
        return refused

    def take(self, name: str) -> Path:
        """See `SimulationServer.screenshot`."""
        simulation = self._simulation
        path = self._pictures.place(name)
        moment = self._inbox.submit(lambda: Shot(simulation.q.copy(), simulation.world.poses(), path))
        try:
            shot = moment.result(2.0)
        except FutureTimeout as error:
            moment.cancel()
            raise SimulationError("the simulation does not run", expected="a simulation that makes steps") from error
        self._camera.take(shot)
        return path

    def close(self) -> None:
        """End the process that draws."""
        self._camera.close()
        self._thread.shutdown()

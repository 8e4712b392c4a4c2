"""The page: what is seen of a robot, and what belongs to it."""

from solfer.model.urdf.description import Description
from solfer.scene import SceneState
from solfer.view.drawing import SceneDrawing
from solfer.view.freshness import Freshness
from solfer.view.server import PageServer


class Page:
    """A page of one robot.

    Args:
        server: Serves it.
        description: The robot.
    """

    def __init__(self, server: PageServer, description: Description):
        self._server = server
        self._freshness = Freshness(server)
        self._drawing = SceneDrawing(server.viser.scene, description)

    def update(self, state: SceneState | None) -> None:
        """Show a scene; None: nothing new is known."""
        if state is None:
            return
        with self._server.viser.atomic():
            self._drawing.update(state)
        self._freshness.beat()

"""Commands of pages: one page at a time drags references and drives the base."""

import logging
from collections.abc import Mapping
from functools import partial

import numpy as np
from viser import ClientHandle, GuiButtonHandle, GuiEvent, TransformControlsEvent, TransformControlsHandle

from solfer.errors import NotFinite
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.throttle import Throttle
from solfer.transport import Middleware
from solfer_tools.scene import DraggedReferences, ScenePose, SceneState, ShownReference
from solfer_tools.view.commands.driving_pad import DrivingPad
from solfer_tools.view.commands.requests import PageRequests
from solfer_tools.view.drawing import name_of, wxyz
from solfer_tools.view.life import PageLives
from solfer_tools.view.server import PageServer

SILENCE_TIMEOUT = 0.5
"""Time without a sign of life of the page that commands after which everything comes to rest [s]."""

NO_PAGE_COMMANDS = "no page commands"

logger = logging.getLogger(__name__)


class PageControl:
    """Lets one page command, as long as it shows life.

    Without a sign of it for `SILENCE_TIMEOUT`, or closed, the velocity is zero, references stay where they are, and
    others may command.

    Args:
        server: The pages.
        requests: Carries out what they request.
        middleware: Carries the commands.
    """

    def __init__(self, server: PageServer, requests: PageRequests, middleware: Middleware):
        viser = server.viser
        server.incoming.may_command = self.may_command
        server.incoming.is_free = lambda: self.is_free
        self._viser = viser
        self._throttle = Throttle(logger)
        self._lives = PageLives(server, middleware.now)
        self._requests = requests
        self._dragged = DraggedReferences(middleware)
        self._holder: int | None = None
        self._handles: dict[str, TransformControlsHandle] = {}
        self._shown: dict[str, ShownReference] = {}
        self._frames: Mapping[str, ScenePose] = {}
        self._moved: set[str] = set()
        gui = viser.gui
        with gui.add_folder("control"):
            self._state = gui.add_markdown(NO_PAGE_COMMANDS)
            take = gui.add_button("take control")
            give = gui.add_button("give it back")
            self._pad = DrivingPad(gui, requests, middleware, is_pressed_by=self._is_holder)

        @take.on_click
        async def _(event: GuiEvent[GuiButtonHandle]) -> None:
            requests.submit(("control", event.client_id), partial(self._take, event.client_id))

        @give.on_click
        async def _(event: GuiEvent[GuiButtonHandle]) -> None:
            requests.submit(("control", event.client_id), partial(self._give, event.client_id))

        @viser.on_client_disconnect
        async def _(client: ClientHandle) -> None:
            requests.submit(("control", client.client_id), partial(self._give, client.client_id))

    def update(self, state: SceneState | None) -> None:
        """Publish what is commanded; without a scene, None, nothing is."""
        self._pad.find_modules()
        if self._holder is not None and (state is None or self._lives.age(self._holder) > SILENCE_TIMEOUT):
            self._rest()
        if state is not None:
            self._show(state)
        self._pad.drive()
        for name in self._moved & set(self._shown):
            self._dragged.drag(self._shown[name], self._name, None)
        self._dragged.publish()

    def may_command(self, client: int | None) -> bool:
        """Return whether a page commands; another one is informed that it does not."""
        if client is not None and not self._is_holder(client):
            self._refuse(client, "another page, or none, commands: take control first")
        return self._is_holder(client)

    @property
    def is_free(self) -> bool:
        """Whether no page commands."""
        return self._holder is None

    @property
    def _name(self) -> str:
        """Name of the page that commands; empty: none does."""
        return "" if self._holder is None else str(self._holder)

    def _is_holder(self, client: int | None) -> bool:
        return self._holder is not None and client == self._holder

    def _take(self, client: int | None) -> None:
        if client is None or self._is_holder(client):
            return
        if self._holder is not None:
            self._refuse(client, "another page commands")
        elif self._lives.age(client) > SILENCE_TIMEOUT:
            self._refuse(client, "this page does not answer in time to command")
        else:
            self._holder = client
            self._state.content = f"page {client} commands"

    def _refuse(self, client: int, reason: str) -> None:
        page = self._viser.get_clients().get(client)
        if self._throttle.warning(f"{client} {reason}", "page %d: %s", client, reason) and page is not None:
            page.add_notification("solfer", reason, color="red", auto_close_seconds=5.0)

    def _give(self, client: int | None) -> None:
        if self._is_holder(client):
            self._rest()

    def _rest(self) -> None:
        """Let everything come to rest, and others command."""
        for name in self._moved & set(self._shown):
            shown = self._shown[name]
            self._dragged.drag(shown, self._name, shown.own)
        self._dragged.publish()
        for name in self._moved & set(self._shown):
            self._dragged.release(self._shown[name], self._name)
        self._moved.clear()
        self._pad.release()
        self._holder = None
        self._state.content = NO_PAGE_COMMANDS

    def _show(self, state: SceneState) -> None:
        """Keep the handles where the references are, but for those that are dragged."""
        self._frames = state.measured
        self._shown = {name_of(each): each for each in state.references}
        for name in set(self._handles) - set(self._shown):
            self._handles.pop(name).remove()
        for name, shown in self._shown.items():
            if name not in self._handles:
                self._handles[name] = self._made(name, shown)
            if name not in self._moved:
                self._handles[name].wxyz = wxyz(shown.reference)
                self._handles[name].position = shown.reference.position

    def _made(self, name: str, shown: ShownReference) -> TransformControlsHandle:
        handle = self._viser.scene.add_transform_controls(
            f"/drag{name}",
            scale=0.25,
            disable_axes=shown.quantity == "orientation",
            disable_sliders=shown.quantity == "orientation",
            disable_rotations=shown.quantity == "position",
            wxyz=wxyz(shown.reference),
            position=shown.reference.position,
        )

        async def moved(event: TransformControlsEvent) -> None:
            position = handle.position.copy()
            quaternion = handle.wxyz.copy()
            drag = partial(self._drag, name, event.client_id, event.phase, position=position, quaternion=quaternion)
            self._requests.submit((name, event.client_id, event.phase), drag)

        handle.on_update(moved)
        return handle

    def _drag(self, name: str, client: int | None, phase: str, position: np.ndarray, quaternion: np.ndarray) -> None:
        shown = self._shown.get(name)
        if shown is None or not self._is_holder(client):
            return
        if phase == "end":
            self._moved.discard(name)
            self._dragged.release(shown, self._name)
            return
        try:
            pose = ScenePose(position, rotation_from_quaternion(np.roll(quaternion, -1)))
        except NotFinite:
            return
        if phase == "update" and np.linalg.norm(position - shown.reference.position) <= 5.0:  # [m]
            frame = self._frames.get(shown.frame, ScenePose(np.zeros(3), np.eye(3)))
            own = ScenePose(frame.seen(pose.position), frame.rotation.T @ pose.rotation)
            self._moved.add(name)
            self._dragged.drag(shown, self._name, own)

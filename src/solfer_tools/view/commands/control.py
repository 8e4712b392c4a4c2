"""Commands of pages: one page at a time drags references and drives the base."""

import logging
import time
from collections.abc import Callable, Mapping
from functools import partial
from threading import Lock
from typing import Literal

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

ONLY_WATCHES = "this page only watches: `solfer view --control` also drives"

logger = logging.getLogger(__name__)


class PageControl:
    """Lets one page command, as long as it shows life.

    The first page that presses, drags or changes something takes control, where no page has it. Without a sign of life
    for `SILENCE_TIMEOUT`, or closed, the velocity is zero, references stay where they are, and others may command. A
    page that was silent takes control by its button alone: what it pressed before must not go on.

    Args:
        server: The pages.
        requests: Carries out what they request.
        middleware: Carries the commands.
        now: Time of the pages [s]; any thread may request it.
    """

    def __init__(self, server: PageServer, requests: PageRequests, middleware: Middleware, now: Callable[[], float]):
        viser = server.viser
        server.incoming.may_command = self.may_command
        server.incoming.is_free = lambda: self.is_free
        self._viser = viser
        self._throttle = Throttle(logger, 3.0)
        self._requests = requests
        self._dragged = DraggedReferences(middleware)
        self._lock = Lock()
        self._holder: int | None = None
        self._since = ""
        self._silent: set[int] = set()
        self._handles: dict[str, TransformControlsHandle] = {}
        self._shown: dict[str, ShownReference] = {}
        self._frames: Mapping[str, ScenePose] = {}
        self._moved: set[str] = set()
        gui = viser.gui
        with gui.add_folder("control"):
            self._pad = DrivingPad(gui, requests, middleware, is_pressed_by=self.may_command, now=now)
            self._lives = PageLives(server, now, press=self._pad.press)
            take = gui.add_button("take control")
            give = gui.add_button("give it back")

        @take.on_click
        async def _(event: GuiEvent[GuiButtonHandle]) -> None:
            requests.submit(("control", event.client_id), partial(self._take_by_button, event.client_id))

        @give.on_click
        async def _(event: GuiEvent[GuiButtonHandle]) -> None:
            requests.submit(("control", event.client_id), partial(self._give, event.client_id))

        @viser.on_client_disconnect
        async def _(client: ClientHandle) -> None:
            requests.submit(("control", client.client_id), partial(self._end, client.client_id))

    def update(self, state: SceneState | None) -> None:
        """Publish what is commanded; without a scene, None, nothing is."""
        self._pad.find_modules()
        if self._holder is not None and (state is None or self._lives.age(self._holder) > SILENCE_TIMEOUT):
            self._silent.add(self._holder)
            self._rest()
        if state is not None:
            self._show(state)
        self._pad.drive()
        for name in self._moved & set(self._shown):
            self._dragged.drag(self._shown[name], self._name, None)
        self._dragged.publish()

    def may_command(self, client: int | None) -> bool:
        """Return whether a page commands, from any thread; it takes control if no page has it, else gets the reason."""
        if client is None:
            return False
        if not self._is_holder(client):
            self._take(client)
        return self._is_holder(client)

    def state(self, client: int) -> str:
        """Return which page has control, for a page that reads it."""
        if self._holder is None:
            return "no page has control"
        return "you have control" if self._is_holder(client) else self._holding

    @property
    def is_free(self) -> bool:
        """Whether no page commands."""
        return self._holder is None

    @property
    def _name(self) -> str:
        """Name of the page that commands; empty: none does."""
        return "" if self._holder is None else str(self._holder)

    @property
    def _holding(self) -> str:
        return f"page {self._holder} has control since {self._since}"

    def _is_holder(self, client: int | None) -> bool:
        return self._holder is not None and client == self._holder

    def _take_by_button(self, client: int | None) -> None:
        if client is not None and not self._is_holder(client):
            self._silent.discard(client)
            self._take(client)

    def _take(self, client: int) -> None:
        """Let a page command, or notify it of the reason why not."""
        with self._lock:
            is_taken = self._holder is not None
            refusal = ""
            if is_taken:
                refusal = self._holding
            elif self._lives.age(client) > SILENCE_TIMEOUT:
                refusal = "this page does not answer in time to command"
            elif client in self._silent:
                refusal = "this page lost control, since it did not answer in time: press 'take control'"
            else:
                self._since = time.strftime("%H:%M")
                self._holder = client
        if refusal:
            self._refuse(client, refusal)
        else:
            self._notify(client, "you have control now", "green")

    def _refuse(self, client: int, reason: str) -> None:
        if self._throttle.warning(f"{client} {reason}", "page %d: %s", client, reason):
            self._notify(client, reason, "red")

    def _notify(self, client: int, text: str, color: Literal["red", "green"]) -> None:
        page = self._viser.get_clients().get(client)
        if page is not None:
            page.add_notification("solfer", text, color=color, auto_close_seconds=5.0)

    def _give(self, client: int | None) -> None:
        if self._is_holder(client):
            self._rest()

    def _end(self, client: int) -> None:
        self._silent.discard(client)
        self._give(client)

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
        if shown is None or not self.may_command(client):
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

"""What each page looks at and what it hides, of which other pages notice nothing."""

import math
from functools import partial

import numpy as np
from viser import ClientHandle, ViserServer
from viser._messages import (
    Message,
    SetCameraLookAtMessage,
    SetCameraPositionMessage,
    SetOrientationMessage,
    SetPositionMessage,
    SetSceneNodeVisibilityMessage,
)

from solfer_tools.scene import ScenePose
from solfer_tools.view.commands.requests import PageRequests

CAMERA = (2.6, -2.2, 1.6)
"""Where a page looks from at first, from the point of the ground below the base, in its heading [m]."""

TARGET = (0.0, 0.0, 0.6)
"""Where it looks to then [m]."""

VIEWS = {
    "robot": (CAMERA, TARGET),
    "front": ((3.6, 0.0, 0.9), TARGET),
    "side": ((0.0, -3.6, 0.9), TARGET),
    "top": ((-0.01, 0.0, 4.6), (0.0, 0.0, 0.0)),
}
"""Places of the camera and of what it looks to, in the same way, by the names of their buttons."""

SHOWN = {  # group of the drawing: label, colour and meaning
    "/desired": (
        "desired robot",
        "#4c8cff",
        "links that differ by more than 2 mm from the measured ones; of the recording beside it, if one is shown",
    ),
    "/forces": ("forces", "#e64c1a", "forces of the ground, 1 mm for each newton"),
    "/support": ("support polygon", "#1ab333", "support polygon; yellow: with its margins"),
    "/center": ("centre of mass", "#1a66e6", "centre of mass; red: its projection on the ground"),
    "/path": ("path", "#9933cc", "path of the base; orange: as odometry estimates it"),
    "/names": ("names", "#495057", "names of the tasks' references; grey ball: the target"),
    "/world": ("world", "#948c80", "what the robot stands on and bumps into in a simulation"),
}
"""What a page may hide, with its legend."""

HIGHEST_BASE = 1.1
"""Height of a base above what the camera takes for the ground from which on this rises with it [m]."""

UPRIGHT = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)
"""Quaternion (w, x, y, z) that turns the axes of the world, z up, to those of the browser, y up."""


class OwnViews:
    """Lets each page follow the base, look from another side, and hide what is drawn.

    The camera stands still, and the world moves below it: so nothing disturbs a person who turns the camera meanwhile.

    Args:
        viser: The pages.
        requests: Carries out what they request.
    """

    def __init__(self, viser: ViserServer, requests: PageRequests):
        self._viser = viser
        self._requests = requests
        self._views: dict[int, _OwnView] = {}
        viser.scene._queue_scene_message(SetOrientationMessage("", UPRIGHT))

    def update(self, base: ScenePose) -> None:
        """Follow the base."""
        clients = self._viser.get_clients()
        for gone in set(self._views) - set(clients):
            del self._views[gone]
        for number, client in clients.items():
            if number not in self._views:
                self._views[number] = _OwnView(client, self._requests)
            self._views[number].update(base)


class _OwnView:
    """That of one page."""

    def __init__(self, client: ClientHandle, requests: PageRequests):
        self._client = client
        self._base: ScenePose | None = None
        self._center = np.full(3, np.nan)
        self._ground = 0.0
        gui = client.gui
        with gui.add_folder("view", expand_by_default=False, order=0.0):
            looks = gui.add_button_group("look at", tuple(VIEWS))
            self._follows = gui.add_checkbox("camera follows the base", True)
            for group, (label, color, meaning) in SHOWN.items():
                shown = gui.add_checkbox(label, True, hint=meaning)
                shown.on_update(partial(self._switch, group))
                gui.add_html(f'<p style="margin:0 1em;font-size:0.8em"><b style="color:{color}">■</b> {meaning}</p>')

        @looks.on_click
        async def _(_: object) -> None:
            requests.submit(("look", client.client_id), partial(self._look, looks.value))

    def update(self, base: ScenePose) -> None:
        """Follow the base, if that is chosen."""
        is_first = self._base is None
        self._base = base
        x, y, height = base.position
        self._ground = min(max(self._ground, height - HIGHEST_BASE), height)  # a squat is seen, a hill is climbed
        center = np.array((x, y, self._ground))
        if self._follows.value and not np.allclose(center, self._center, rtol=0.0, atol=5e-4):
            self._center = center
            self._send(SetPositionMessage("", (-center[0], -center[2], center[1])))
        if is_first:
            self._look("robot")

    async def _switch(self, group: str, event: object) -> None:
        self._send(SetSceneNodeVisibilityMessage(group, bool(event.target.value)))  # type: ignore[attr-defined]

    def _look(self, name: str) -> None:
        assert self._base is not None
        ahead = self._base.rotation[:2, 0]
        cosine, sine = ahead / (np.linalg.norm(ahead) or 1.0)
        turn = np.array(((cosine, -sine, 0.0), (sine, cosine, 0.0), (0.0, 0.0, 1.0)))
        camera, target = (np.array(each) for each in VIEWS[name])
        width, height = self._client.camera.image_width, self._client.camera.image_height
        if 0 < width < 0.65 * height:  # a narrow picture: farther away, so that the robot is in it
            camera = target + 0.65 * height / width * (camera - target)
        center = (*self._base.position[:2], self._ground)
        place, aim = (tuple((turn @ each + center).tolist()) for each in (camera, target))
        self._send(SetCameraPositionMessage(place))
        self._send(SetCameraLookAtMessage(aim))

    def _send(self, message: Message) -> None:
        self._client._websock_connection.queue_message(message)

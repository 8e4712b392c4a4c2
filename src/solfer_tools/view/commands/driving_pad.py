"""The pad of a page: buttons and keys that drive the base."""

import math
from collections.abc import Callable
from functools import partial

from viser import GuiApi

from solfer.errors import MiddlewareError
from solfer.transport import Middleware, Writer
from solfer_tools.navigation.course import twist
from solfer_tools.scene.discovery import TopicRequests
from solfer_tools.view.commands.requests import PageRequests

CMD_VEL = "cmd_vel"

DIRECTIONS = {  # x, y, yaw
    "ahead": (1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "turn left": (0.0, 0.0, 1.0),
    "turn right": (0.0, 0.0, -1.0),
}
"""Components of the velocity, by what a page may press."""

PAD = (
    *(("turn left", "↺ Q"), ("ahead", "↑ W"), ("turn right", "↻ E")),
    *(("left", "← A"), ("", "space"), ("right", "→ D")),
    *(("", ""), ("back", "↓ S"), ("", "")),
)
"""Rows of three buttons: what each presses, and its text with its key; nothing: rest."""


class DrivingPad:
    """Buttons and keys that drive the base while pressed, by a component and with a speed that are chosen beside them.

    Args:
        gui: Where the buttons are; the script of `PageLives` says which one is pressed.
        requests: Carries out what they request.
        middleware: Carries the velocities.
        is_pressed_by: Whether a page may press them.
        now: Time of the pages [s].
    """

    def __init__(
        self,
        gui: GuiApi,
        requests: PageRequests,
        middleware: Middleware,
        is_pressed_by: Callable[[int | None], bool],
        *,
        now: Callable[[], float],
    ):
        self._requests = requests
        self._middleware = middleware
        self._now = now
        self._is_pressed_by = is_pressed_by
        self._writers: dict[str, Writer] = {}
        self._direction = (0.0, 0.0, 0.0)
        self._pressed = -math.inf
        self._drives = False
        self._topics = TopicRequests(middleware)
        self._module = gui.add_dropdown("base", ("",))
        self._speed = gui.add_slider("speed [m/s]", 0.02, 0.5, 0.02, 0.1)
        gui.add_html(_pad())

    def find_modules(self) -> None:
        """Look once a second which components drive the base."""
        try:
            topics = self._topics.answer()
        except MiddlewareError:
            return
        received = () if topics is None else topics.received
        modules = sorted(name.removesuffix(f"/{CMD_VEL}") for name in received if name.endswith(f"/{CMD_VEL}"))
        if modules and tuple(modules) != tuple(self._module.options):
            self._module.options = tuple(modules)

    def drive(self) -> None:
        """Publish the velocity while a button is pressed, then zero once."""
        pressed = self._now() - self._pressed <= 0.25  # [s]; a pressed button says so ten times a second
        module = str(self._module.value)
        if not module or not (pressed or self._drives):
            return
        speed = float(self._speed.value) if pressed else 0.0
        x, y, yaw = (speed * each for each in self._direction)
        if module not in self._writers:
            topic = self._middleware.resolve(f"{module}/{CMD_VEL}")
            self._writers[module] = self._middleware.declared_writer(topic, "geometry_msgs/Twist")
        self._writers[module].write(twist(x, y, 2.0 * yaw))  # 2 rad/s at 1 m/s
        self._drives = pressed

    def release(self) -> None:
        """Release the button that is pressed."""
        self._pressed = -math.inf

    def press(self, client: int, direction: str) -> None:
        """Drive in a direction, as far as the page may, from any thread; unknown ones are ignored."""
        if direction in DIRECTIONS:
            self._requests.submit(("press", client), partial(self._press, client, DIRECTIONS[direction]))

    def _press(self, client: int, direction: tuple[float, float, float]) -> None:
        if self._is_pressed_by(client):
            self._direction = direction
            self._pressed = self._now()


def _pad() -> str:
    look = "padding:0.5em 0;border:1px solid #868e96;border-radius:4px;background:#e7f5ff;color:#1c3d5a"
    buttons = "".join(
        f'<button type="button" data-solfer-drive="{direction}" title="{direction or "rest"}" '
        f'style="{look};touch-action:none">{text}</button>'
        if text
        else "<span></span>"
        for direction, text in PAD
    )
    grid = "display:grid;grid-template-columns:repeat(3,1fr);gap:0.3em;margin:0.5em 1em;user-select:none"
    return f'<div style="{grid}">{buttons}</div>'

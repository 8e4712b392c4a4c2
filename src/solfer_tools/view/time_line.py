"""The time line of a recording."""

import math

from viser import GuiButtonHandle, GuiInputHandle

from solfer_tools.view.commands.requests import PageRequests
from solfer_tools.view.playback import Playback
from solfer_tools.view.server import PageServer


class TimeLine:
    """Plays, pauses and scrubs.

    Args:
        server: The page.
        requests: Carries it out.
        playback: What is played.
    """

    def __init__(self, server: PageServer, requests: PageRequests, playback: Playback):
        self._playback = playback
        step = 0.01  # [s]
        length = max(math.floor(100.0 * (playback.end - playback.begin)) / 100.0, step)
        gui = server.viser.gui
        self._slider: GuiInputHandle[float] = gui.add_slider("time [s]", 0.0, length, step, 0.0)
        self._button: GuiButtonHandle = gui.add_button("pause")
        speed = gui.add_dropdown("speed", ("0.1", "0.25", "0.5", "1", "2", "4", "10"), initial_value="1")
        server.incoming.display |= {each._impl.uuid for each in (self._slider, self._button, speed)}

        @self._button.on_click
        async def _(_: object) -> None:
            requests.submit("toggle", self._toggle)

        @self._slider.on_update
        async def _(event: object) -> None:
            time = self._slider.value
            if event.client is not None:  # type: ignore[attr-defined]
                requests.submit("scrub", lambda: self._scrub(time))

        @speed.on_update
        async def _(_: object) -> None:
            factor = float(speed.value)
            requests.submit("speed", lambda: setattr(playback, "speed", factor))

    def update(self) -> None:
        """Show the present time."""
        self._slider.value = round(self._playback.time - self._playback.begin, 2)  # type: ignore[misc]  # viser's own way
        label = "pause" if self._playback.plays else "play"
        if self._button.label != label:
            self._button.label = label

    def _toggle(self) -> None:
        playback = self._playback
        if not playback.plays and playback.time >= playback.end:
            playback.seek(playback.begin)
        playback.plays = not playback.plays

    def _scrub(self, time: float) -> None:
        self._playback.plays = False
        self._playback.seek(self._playback.begin + time)

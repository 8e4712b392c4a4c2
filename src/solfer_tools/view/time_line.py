"""The time line of a recording."""

import html
import math

from viser import GuiButtonHandle, GuiHtmlHandle, GuiInputHandle

from solfer.recording.model import REQUEST, Event
from solfer_tools.view.commands.requests import PageRequests
from solfer_tools.view.playback import Playback
from solfer_tools.view.server import PageServer

COLORS = dict.fromkeys(("abort", "aborted", "fault", "lost"), "#c92a2a") | {"hold": "#e8590c", REQUEST: "#74c0fc"}
"""Colours of events that are no starts and ends, by their kind."""


class EventMarks:
    """Marks of what happened, above the time line; its pictures take what is new now and then, as an hour has many.

    Args:
        server: The page.
        playback: What is played.
    """

    COLUMNS = 300
    """How many places there are; of equal events at one place the first has its text there."""

    def __init__(self, server: PageServer, playback: Playback):
        self._playback = playback
        self._marks: dict[tuple[int, str], str] = {}
        self._is_complete = False
        self._html: GuiHtmlHandle = server.viser.gui.add_html("")

    def update(self) -> None:
        """Take some more events, and show the marks once all are there."""
        if self._is_complete:
            return
        events = self._playback.next_events()
        for event in events:
            self._mark(event)
        if not events:
            self._is_complete = True
            marks = "".join(self._marks.values())
            self._html.content = (
                f'<svg viewBox="0 0 {self.COLUMNS} 12" preserveAspectRatio="none" role="img" aria-label="events" '
                f'style="width:calc(100% - 2em);height:12px;margin:0 1em">{marks}</svg>'
            )

    def _mark(self, event: Event) -> None:
        playback = self._playback
        ratio = (event.time - playback.begin) / ((playback.end - playback.begin) or 1.0)
        place = int(min(max(ratio, 0.0), 1.0) * (self.COLUMNS - 1))
        color = COLORS.get(event.kind, "#2b8a3e")
        height = 5 if event.kind == REQUEST else 12
        text = f"{event.time - playback.begin:.2f} s {event.plugin} {event.kind} {event.text}"
        self._marks.setdefault(
            (place, color),
            f'<rect x="{place}" y="{12 - height}" width="1" height="{height}" fill="{color}">'
            f"<title>{html.escape(text[:200])}</title></rect>",
        )


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
        self._marks = EventMarks(server, playback)
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
        self._marks.update()
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

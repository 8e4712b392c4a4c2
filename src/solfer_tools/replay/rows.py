"""The rows of one plugin in a recording, cycle by cycle."""

from collections.abc import Sequence

import numpy as np

from solfer.errors import RecordingError, UnknownName
from solfer.recording.model import REQUEST, Channel, Recording
from solfer.recording.selection import HALF_OF_RESOLUTION
from solfer.transport.plugin_state import PluginState

LIFE = "life"
"""Channel with the state of a plugin; each cycle has a row of it."""


class RecordedRows:
    """What was recorded of a plugin, at the times of its cycles.

    Args:
        recording: The recording.
        plugin: Name of the plugin in it.
        where: Its file, for errors.

    Attributes:
        recording, plugin, where: See above.
        times: Time of each cycle, shape (T,) [s].
        states: State of the plugin after each cycle, a number of `PluginState`, shape (T,).
        blends: Shortest time in which its commands blend in at a start, shape (T,) [s].

    Raises:
        UnknownName: The recording has no such plugin.
        RecordingError: It lacks the states of the plugin, or has no cycle of it.
    """

    def __init__(self, recording: Recording, plugin: str, where: str = ""):
        self.recording = recording
        self.plugin = plugin
        self.where = where
        known = [name.removesuffix(f"/{LIFE}") for name in recording.channels if name.endswith(f"/{LIFE}")]
        if plugin not in known:
            raise UnknownName("plugin", plugin, known, where=where, expected="" if known else "a whole recording")
        life = recording[f"{plugin}/{LIFE}"]
        if not len(life.times):
            raise RecordingError(f"there is no cycle of '{plugin}'", where=where, expected="a plugin that ran")
        self.times, self.states, self.blends = life.times, life.column("state").astype(int), life.column("blend")

    @property
    def has_time(self) -> bool:
        """Whether the time that passed for the robot was recorded."""
        return "passed" in self.recording[f"{self.plugin}/{LIFE}"].columns

    @property
    def running(self) -> np.ndarray:
        """Whether the component ran, in each cycle, shape (T,)."""
        return self.states == PluginState.RUNNING

    def requests(self) -> dict[int, list[str]]:
        """Return the requests to the component, by the index of the cycle that carried them out."""
        found: dict[int, list[str]] = {}
        for event in self.recording.events:
            if event.plugin == self.plugin and event.kind == REQUEST:
                row = int(np.searchsorted(self.times, event.time - HALF_OF_RESOLUTION))
                found.setdefault(row, []).append(event.text)
        return found

    def channel(self, name: str) -> Channel | None:
        """Return the channel `<plugin>/<name>`; None: there is none, or it has no row."""
        found = self.recording.channels.get(f"{self.plugin}/{name}")
        return found if found is not None and len(found.times) else None

    def places(self, channel: Channel) -> np.ndarray:
        """Return the newest row of a channel at each cycle, shape (T,); -1 before its first one."""
        return np.searchsorted(channel.times, self.times + HALF_OF_RESOLUTION, side="right") - 1

    def values(self, channel: Channel, columns: Sequence[str]) -> np.ndarray:
        """Return columns at each cycle, shape (T, columns); NaN before the first row, later the newest one.

        Raises:
            UnknownName: A column is missing.
        """
        for column in columns:
            if column not in channel.columns:
                raise UnknownName("column", column, channel.columns, where=f"{self.where}: channel '{channel.name}'")
        chosen = [channel.columns.index(column) for column in columns]
        places = self.places(channel)
        values = channel.values[np.maximum(places, 0)][:, chosen]
        values[places < 0] = np.nan
        return values

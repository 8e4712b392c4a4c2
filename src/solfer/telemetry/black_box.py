"""Records a loop and its plugins."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from solfer.plugins.life.managed_plugin import ManagedPlugin
from solfer.plugins.plugin import Plugin
from solfer.recording.kinds import NAMED
from solfer.recording.log import Logger
from solfer.recording.model import Event
from solfer.recording.versions import versions
from solfer.telemetry.plugin_log import NANOSECOND, PluginLog
from solfer.telemetry.recorder import DURATION, Recorder
from solfer.transport.endpoints import NEW, Reader
from solfer.transport.plugin_state import PluginState

LOOP_PREFIX = "loop"
"""Begin of the names of the channels that belong to no plugin."""

TRUTH_MESSAGE = "nav_msgs/Odometry"
"""Message of the true state of a simulated base."""


class BlackBox(Recorder):
    """Records each cycle: its timing, and of every plugin what `PluginLog` lists; and the changes of their states.

    Further channels are `loop/timing` with lateness and duration of each cycle [s], `loop/cycle` with its number, and
    `loop/states` with a number of `PluginState` for each plugin; and `<plugin>/ros_time` and `<plugin>/truth`, if
    there are such things; the truth is NaN until it has been received. A plugin that does not run keeps its last
    commands.

    Args:
        folder: Folder of the memory, such as the namespace's.
        plugins: The plugins.
        seconds: Duration that the memory holds [s].
        ros_time: Reads ROS time [s]; None: there is none.
        truth: Receives the true pose and velocity of the base, a `BodyMessage`, from a simulator; None: there is none.

    Raises:
        MiddlewareError: Another process records there, or there is no room.
        ComponentError: A component cannot declare what it logs.
    """

    _KINDS = {
        PluginState.STARTING: "start",
        PluginState.RUNNING: "run",
        PluginState.STOPPING: "stop",
        PluginState.ABORTED: "abort",
        PluginState.CLOSED: "close",
    }
    """Kinds of events, by the state that a plugin enters; of other states, their names."""

    def __init__(
        self,
        folder: Path,
        plugins: Sequence[Plugin],
        seconds: float = DURATION,
        ros_time: Callable[[], float] | None = None,
        truth: Reader | None = None,
    ):
        for plugin in plugins:
            plugin.requests.enabled = True
        logs = tuple(PluginLog(plugin) for plugin in plugins)
        loop = Logger(LOOP_PREFIX)
        # methods and lists as they are: the cycle looks nothing up
        self._takes = tuple(log.take for log in logs)
        self._notes = tuple((plugin.name, plugin.requests.notes) for plugin in plugins)
        # lateness, duration, number of the cycle, states, ROS time: one piece of memory, as in `PluginLog`
        self._words = memoryview(words := np.zeros(4 + len(plugins), dtype=np.int64)).cast("B").cast("q")
        loop.add("timing", words[:2], ("lateness", "duration"), "s", factor=NANOSECOND)
        loop.add("cycle", words[2:3], ("cycle",))
        loop.add("states", words[3:-1], [plugin.name for plugin in plugins])
        self._ros_time = ros_time
        for plugin in plugins if ros_time is not None else ():  # with each, since it may be recorded alone
            Logger(plugin.name, loop.sources).add("ros_time", words[-1:], ("time",), "s", factor=NANOSECOND)
        self._truth = truth
        self._true = np.full(len(NAMED[TRUTH_MESSAGE]), np.nan)
        for plugin in plugins if truth is not None else ():
            link = plugin.robot.kinematics.base_link or ""
            Logger(plugin.name, loop.sources).add("truth", self._true, frame="world", kind=TRUTH_MESSAGE, child=link)
        sources = [*loop.sources, *(source for log in logs for source in log.sources)]
        files: dict[str, str] = {}
        texts = versions()
        for plugin in plugins:
            documents = plugin.documents()
            files |= {f"{plugin.name}/{name}": text for name, text in documents.files.items()}
            texts |= documents.texts
        super().__init__(folder, sources, plugins[0].rate, seconds=seconds, attachments=files, metadata=texts)

    def record(self, time: int, late: int, took: int) -> None:
        """Record a cycle that ends at `time`, began `late` after its deadline and `took` so long [ns]."""
        words = self._words
        now = NANOSECOND * time
        words[0] = late
        words[1] = took
        words[2] += 1
        if self._ros_time is not None:
            words[-1] = round(1e9 * self._ros_time())
        if self._truth is not None and self._truth.read() is NEW:
            body = self._truth.message
            np.concatenate((body.position, body.orientation, body.linear, body.angular), out=self._true)
        for take in self._takes:
            take(now)
        self.append(time)
        for name, notes in self._notes:
            if notes:
                for kind, text in notes:
                    self.event(Event(now, name, kind, text=text))
                notes.clear()

    def note(self, index: int, managed: ManagedPlugin, time: int) -> None:
        """Record a plugin's new state or reason at `time` [ns]."""
        state = managed.state
        ran = self._words[3 + index] == PluginState.RUNNING
        self._words[3 + index] = state
        # a plugin that ran and has to start again holds
        kind = "hold" if ran and state is PluginState.STARTING else self._KINDS.get(state, state.name.lower())
        self.event(Event(NANOSECOND * time, managed.name, kind, text=managed.reason))

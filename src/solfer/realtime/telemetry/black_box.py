"""Records an RT layer and its plugins."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from solfer.realtime.lifecycle import Cyclic
from solfer.realtime.telemetry.recorder import SECONDS, Recorder

INTERFACES = ("position", "velocity", "torque")
"""Interfaces of measured and desired State that are recorded."""


class BlackBox:
    """Records each cycle: its timing, and the measured State, desired State and commands of every plugin.

    Columns are `lateness` and `duration` of the cycle [s]; `stages`, a number of `PluginState` for each of the
    `plugins`; of each plugin `<plugin>.measured.<interface>` and `<plugin>.desired.<interface>`, one number for each of
    `<plugin>.dofs`, and `<plugin>.sent.<controller>.<field>` for the joints `<plugin>.sent.<controller>.joints`, in the
    names, signs and zeros of the lower level. The commands of a plugin that does not run are its last ones.

    Args:
        folder: The namespace's folder.
        plugins: The plugins.
        seconds: Duration that the memory holds [s].

    Attributes:
        stages: State of each plugin, `PluginState`; the executor writes it.
        size: Size of the memory [B].

    Raises:
        MiddlewareError: Another process records there, or there is no room.
    """

    def __init__(self, folder: Path, plugins: Sequence[Cyclic], seconds: float = SECONDS):
        self._late, self._took, self.stages = np.zeros(()), np.zeros(()), np.zeros(len(plugins))
        sources = {"lateness": self._late, "duration": self._took, "stages": self.stages}
        labels = {"plugins": [plugin.name for plugin in plugins]}
        for plugin in plugins:
            name, robot = plugin.name, plugin.robot
            labels[f"{name}.dofs"] = robot.dofs
            for title, state in (("measured", robot.state), ("desired", robot.command)):
                sources |= {f"{name}.{title}.{interface}": state[interface] for interface in INTERFACES}
            for pipe in plugin.outputs.commanding:
                labels[f"{name}.sent.{pipe.name}.joints"] = pipe.sent.names
                sources |= {f"{name}.sent.{pipe.name}.{field}": getattr(pipe.sent, field) for field, _ in pipe.fields}
        self._recorder = Recorder(folder, sources, plugins[0].rate, seconds, labels)
        self.size = self._recorder.size

    def record(self, time: int, late: int, took: int) -> None:
        """Record a cycle that ends at `time`, began `late` after its deadline and `took` so long [ns]."""
        self._late[...], self._took[...] = 1e-9 * late, 1e-9 * took
        self._recorder.record(time)

    def close(self) -> None:
        """Remove the recording. A process that ends without this leaves its last seconds to readers."""
        self._recorder.close()

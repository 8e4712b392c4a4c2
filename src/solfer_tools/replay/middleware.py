"""Surroundings of a replayed plugin: a clock that follows the recording, and services without answers."""

from collections.abc import Mapping
from typing import Any

from solfer.config import Configuration
from solfer.plugins.generation.dry_run import DryMiddleware
from solfer.recording.model import JOINTS_KIND
from solfer.robot.description.shipped import RobotFiles
from solfer.transport.messages import GAINS
from solfer_tools.replay.rows import RecordedRows


class ReplayMiddleware(DryMiddleware):
    """Connects to nothing; descriptions, joints of controllers and gains are those of the recording.

    Args:
        configuration: The plugin's configuration.
        files: The robot's files, for what the recording does not have.
        rows: The recording.

    Attributes:
        time: Time of the present cycle [s].
    """

    def __init__(self, configuration: Configuration, files: RobotFiles, rows: RecordedRows):
        super().__init__(configuration, files)
        self.time = float(rows.times[0])
        self._rows = rows
        self._recorded = dict(_descriptions(self.configuration, rows))

    def now(self) -> float:
        """See `Middleware.now`."""
        return self.time

    def running(self) -> bool:
        """See `Middleware.running`."""
        return True

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`."""
        return self._recorded[name] if name in self._recorded else super().parameter(name, where)

    def joint_order(self, topic: str, message: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.joint_order`; all DoFs of the Robot that was recorded."""
        channel = self._rows.channel("measured/position")
        return channel.columns if channel is not None else super().joint_order(topic, message, timeout, where=where)

    def controller_joints(self, controller: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.controller_joints`; those that it was sent."""
        found: dict[str, None] = {}
        for pipe in self._pipes(controller):
            begin = f"{self._rows.plugin}/command/{pipe}/"
            for name, channel in self._rows.recording.channels.items():
                if name.startswith(begin) and (channel.kind == JOINTS_KIND or name.removeprefix(begin) in GAINS):
                    found |= dict.fromkeys(channel.columns)
        return tuple(found) or super().controller_joints(controller, timeout, where)

    def controller_gains(self, controller: str, timeout: float, where: str = "") -> dict[str, tuple[float, float]]:
        """See `Middleware.controller_gains`; those of its first command."""
        gains: dict[str, tuple[float, float]] = {}
        first = int(self._rows.running.argmax())
        for pipe in self._pipes(controller):
            found = [self._rows.channel(f"command/{pipe}/{gain}") for gain in GAINS]
            channels = [channel for channel in found if channel is not None]
            if len(channels) == len(GAINS):
                pairs = zip(*(self._rows.values(each, each.columns)[first] for each in channels), strict=True)
                gains |= dict(zip(channels[0].columns, pairs, strict=True))
        return gains or super().controller_gains(controller, timeout, where)

    def _pipes(self, controller: str) -> list[str]:
        """Return the names of the pipes to a controller."""
        return [record.name for record in self.configuration.controllers if record.leads_to == controller]


def _descriptions(configuration: Configuration, rows: RecordedRows) -> Mapping[str, str]:
    """Return the recorded descriptions of the Robot, by their parameters."""
    sources = configuration.sources
    files = rows.recording.attachments
    found = {}
    for key in ("urdf", "srdf"):
        source = getattr(sources, key, None)
        name = f"{rows.plugin}/robot.{key}"
        if source is not None and source.parameter is not None and name in files:
            found[source.parameter] = files[name].decode(errors="replace")
    return found

"""Replays a plugin: what it received cycle by cycle, as fast as it can."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from solfer.config import Configuration
from solfer.errors import RecordingError, SolferError
from solfer.numerics.rotations import whole_revolutions
from solfer.pipes.joint.pipes import JointCommandPipe
from solfer.plugins.generation.generator import Generator
from solfer.plugins.plugin import Plugin
from solfer.recording.model import Channel
from solfer.robot.description.shipped import RobotFiles
from solfer.telemetry.plugin_log import PluginLog
from solfer.transport.plugin_state import PluginState
from solfer_tools.replay.feedback import RecordedFeedbackPipe
from solfer_tools.replay.generator import RecordedClaim, RecordedTime, replaying
from solfer_tools.replay.middleware import ReplayMiddleware
from solfer_tools.replay.rows import LIFE, RecordedRows

STOPPED = PluginState.STOPPED
CLOSED = PluginState.CLOSED


@dataclass
class Replay:
    """A plugin in the cycles of a recording; `run` lets it work through them.

    Args:
        plugin: The plugin, made by a generator of `replaying`.
        claim: Its claim.
        middleware: Its clock.
        rows: The recorded cycles.

    Attributes:
        running: Whether the component ran in each cycle of the replay, shape (T,).
        unrepeated: Requests that could not be repeated, with the reason; the recording does not have them whole, or
            the component does not offer them.
        commands: What it sent, by the name of the channel behind `<plugin>/`.
        work: Runs a cycle of the plugin; a measurement takes its place.
    """

    plugin: Plugin
    claim: RecordedClaim
    middleware: ReplayMiddleware
    rows: RecordedRows
    running: np.ndarray = field(init=False)
    unrepeated: list[str] = field(init=False, default_factory=list)
    commands: dict[str, Channel] = field(init=False, default_factory=dict)
    work: Callable[[], None] = field(init=False)
    _requests: dict[int, list[str]] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.work = self.plugin.cycle

    def run(self) -> Iterator[int]:
        """Work through all cycles; yields the index of each.

        Raises:
            RecordingError: The component failed where the recorded one did not; names the cycle.
        """
        log = PluginLog(self.plugin)
        rows = self.rows
        prefix = f"{self.plugin.name}/"
        sources = [each for each in log.sources if each.channel.name.startswith(f"{prefix}command/")]
        values = [np.zeros((len(rows.times), source.array.size)) for source in sources]
        turns = {
            f"command/{pipe.name}/position": self.plugin.robot.revolutions[pipe.dofs]
            for pipe, _ in self.plugin.outputs.controllers
            if isinstance(pipe, JointCommandPipe)
        }
        self._requests = rows.requests()
        self.running = np.zeros(len(rows.times), dtype=bool)
        for row, time in enumerate(rows.times):
            self.middleware.time = float(time)
            self._cycle(row)
            log.take(float(time))
            for source, numbers in zip(sources, values, strict=True):
                numbers[row] = source.array.reshape(-1)
            yield row
        for source, numbers in zip(sources, values, strict=True):
            known = source.channel
            name = known.name.removeprefix(prefix)
            if name in turns:
                self._unwrap(known, numbers, turns[name])
            self.commands[name] = Channel(
                known.name,
                known.kind,
                known.columns,
                units=known.units,
                frame=known.frame,
                times=rows.times,
                values=numbers,
                child=known.child,
            )

    def unrepeated_inputs(self) -> Iterator[str]:
        """Yield the inputs that a replay that differs did not get as the recorded plugin did."""
        rows = self.rows
        found = [cast(RecordedFeedbackPipe, each).unrepeated for each in self.plugin.feedbacks]
        found += [f"request {text}" for text in self.unrepeated]
        if rows.recording.lost:
            found.append(f"{rows.recording.lost} cycles, which were not recorded")
        if rows.running[0]:
            found.append("all that came before the recording, which begins while the plugin runs")
        if not rows.has_time:
            found.append("the time that passed for the robot, which an older recording does not have")
        yield from filter(None, found)

    def _cycle(self, row: int) -> None:
        """Bring the plugin to the recorded state of its life, and let it work if the recorded one worked."""
        plugin = self.plugin
        state = self.rows.states[row]
        for feedback in plugin.feedbacks:
            cast(RecordedFeedbackPipe, feedback).row = row
        if isinstance(plugin.robot_time, RecordedTime):
            plugin.robot_time.row = row
        self.claim.ours = bool(state == PluginState.RUNNING)
        for note in self._requests.pop(row, ()):
            self._repeat(note)
        plugin.blend_in(float(self.rows.blends[row]))
        try:
            if state in (STOPPED, CLOSED):
                plugin.stop()
            else:
                plugin.restart()
                self.work()
        except Exception as error:
            raise RecordingError(
                f"the plugin fails in cycle {row + 1}, {self.rows.times[row] - self.rows.times[0]:.3f} s after the "
                f"first one: {error}",
                where=self.rows.where,
                expected="a plugin that works with what was recorded",
            ) from error
        self.running[row] = plugin.running

    def _repeat(self, note: str) -> None:
        """Repeat recorded requests, at the beginning of the cycle."""
        try:
            self.plugin.inbox.submit(self.plugin.requests.repeated(note))
        except ValueError:
            self.unrepeated.append(f"{note[:60]}...: it is longer than an event")
        except SolferError as error:
            self.unrepeated.append(f"{note[:60]}: {error.line}")

    def _unwrap(self, channel: Channel, numbers: np.ndarray, turns: np.ndarray) -> None:
        """Count positions, shape (T, n) [rad, m], as the recorded driver did; a replay receives the Robot's count."""
        recorded = self.rows.channel(channel.name.partition("/")[2])
        if recorded is not None and set(channel.columns) <= set(recorded.columns):
            differences = numbers - self.rows.values(recorded, channel.columns)
            numbers -= whole_revolutions(np.nan_to_num(differences), turns)


def make(configuration: Configuration, generator: type[Generator], files: RobotFiles, rows: RecordedRows) -> Replay:
    """Make a replay.

    Args:
        configuration: Of the plugin.
        generator: That of its component, see `Registry.find`.
        files: The robot's files, for what the recording does not have.
        rows: The recorded cycles.

    Raises:
        SolferError: The plugin cannot be made, or the recording lacks something that it receives.
        SolferErrors: Several mistakes.
    """
    middleware = ReplayMiddleware(configuration, files, rows)
    made = replaying(generator, rows)(middleware.configuration, middleware)
    plugin = made.plugin()
    if rows.has_time:
        life = rows.recording[f"{rows.plugin}/{LIFE}"]
        plugin.robot_time = RecordedTime(plugin, life.column("passed"), life.column("lost"))
    return Replay(plugin, made.claim, middleware, rows=rows)

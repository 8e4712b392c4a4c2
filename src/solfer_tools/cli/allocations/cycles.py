"""Cycles in which a plugin is measured: those of a recording, or on its simulated robot."""

import dataclasses
import sys
import tracemalloc
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path

from solfer.cli.plugins import generator_of
from solfer.config import Configuration
from solfer.errors import RecordingError, SimulationError
from solfer.plugins import Plugin, generate
from solfer.robot.description.shipped import RobotFiles
from solfer_tools.cli.allocations.meter import LineCost, LineMeter
from solfer_tools.cli.allocations.ownership import Ownership
from solfer_tools.cli.allocations.standing_robot import StandingRobot
from solfer_tools.cli.recordings.replay import opened
from solfer_tools.replay.replay import Replay
from solfer_tools.replay.rows import RecordedRows

MEASURED_CYCLES = 200
"""Most cycles that are run after the start."""


class CycleMeter:
    """Measures the cycles of a plugin, one after the other, in which its component runs.

    The first half of them warms up, the next quarter shows what stays, the last one what each line takes.

    Args:
        plugin: The plugin.
        cycles: Number of cycles to measure.

    Attributes:
        warm, kept, traced: Number of cycles that warm up, in which was measured what stays, and what each line takes.
    """

    def __init__(self, plugin: Plugin, cycles: int):
        self._plugin = plugin
        self._meter = LineMeter(Ownership(sys.modules[type(plugin.component).__module__]))
        settling = 5  # first cycles with a trace, in which Python itself makes what it keeps
        part = (cycles - settling) // 4
        self.warm = 2 * part
        self.kept = part
        self.traced = part
        ended = self.warm + self.kept
        self._steps: dict[int, Callable[[], None]] = {
            part: self._meter.watch,
            self.warm: self._meter.begin,
            ended: partial(self._meter.end, __file__),
        }
        self._traced_from = ended
        self._counted_from = ended + settling
        self._ran = 0

    @property
    def lines(self) -> Sequence[LineCost]:
        """What each line takes that allocates."""
        return tuple(self._meter.lines.values())

    @property
    def done(self) -> bool:
        """Whether all is measured."""
        return self._ran >= self._counted_from + self.traced

    def cycle(self) -> None:
        """Run one cycle of the plugin, and measure it if it is time for that."""
        work = self._plugin.cycle
        running = self._plugin.running
        if running and self._ran >= self._traced_from and not self.done:
            self._meter.measure(work, counts=self._ran >= self._counted_from)
        else:
            work()
        if running and self._plugin.running:
            self._ran += 1
            if self._ran in self._steps:
                self._steps[self._ran]()


def measured(plugin: Plugin, cycles: int, run: Callable[[CycleMeter], None]) -> CycleMeter:
    """Measure cycles of a plugin.

    Args:
        plugin: The plugin.
        cycles: Their number.
        run: Calls the meter's `cycle` in each cycle, at least until it is `done`.
    """
    meter = CycleMeter(plugin, cycles)
    try:
        run(meter)
    finally:
        tracemalloc.stop()
    return meter


def idle(configuration: Configuration) -> Configuration:
    """Return a configuration that sends nothing to the lower level."""
    return dataclasses.replace(configuration, module=configuration.module.model_copy(update={"mode": "idle"}))


def on_recording(file: Path, name: str, configuration: Path, system: str | None) -> CycleMeter:
    """Measure a plugin in the cycles of a recording.

    Raises:
        SolferError: The recording or the configuration cannot be used, or the plugin did not run long enough.
    """
    with opened(file, name, configuration, plugin="", system=system, changed=idle) as replay:
        return measured(replay.plugin, _enough(replay.rows), lambda meter: _replayed(replay, meter))


def on_simulation(configuration: Configuration, given: RobotFiles | None) -> CycleMeter:
    """Measure a plugin on its simulated robot, which stands.

    Args:
        configuration: Of the plugin.
        given: Files of its robot, instead of those that the configuration names.

    Raises:
        SolferError: The plugin or the robot cannot be made, or the plugin does not start.
    """
    where = f"{configuration.file}: {configuration.name}"
    configuration = idle(configuration)
    with closing(StandingRobot(configuration, given, where)) as robot:
        with closing(generate(configuration, robot.middleware, generator_of(configuration))) as plugin:
            return measured(plugin, MEASURED_CYCLES, lambda meter: _simulated(robot, plugin, meter, where=where))


def _simulated(robot: StandingRobot, plugin: Plugin, meter: CycleMeter, where: str) -> None:
    """Let time pass until enough cycles are measured."""
    robot.every(1.0 / plugin.rate, meter.cycle)
    while not meter.done:
        robot.run(10.0 / plugin.rate)
        if robot.time > 10.0 and not plugin.running:
            raise SimulationError(
                f"the plugin does not start: {plugin.health()[1]}",
                where=where,
                expected="--recording FILE, in which it runs: the simulated robot alone does not publish what it needs",
            )


def _replayed(replay: Replay, meter: CycleMeter) -> None:
    """Work through the cycles of a recording until enough are measured."""
    replay.work = meter.cycle
    for _ in replay.run():
        if meter.done:
            return


def _enough(rows: RecordedRows) -> int:
    """Return the number of cycles to measure.

    Raises:
        RecordingError: There are too few.
    """
    ran = int(rows.running.sum())
    least = 40
    if ran < least:
        raise RecordingError(f"'{rows.plugin}' runs in {ran} cycles", where=rows.where, expected=f"at least {least}")
    return min(MEASURED_CYCLES, ran - 2)  # the cycle of a start is not like others

"""The actions of `solfer replay`."""

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from solfer.cli.columns import aligned
from solfer.cli.plugins import generator_of
from solfer.config import Configuration, load
from solfer.errors import RecordingError
from solfer.plugins.generation.unbuilt import importable_beside
from solfer.recording.model import Recording
from solfer.recording.reader import read
from solfer.robot.description.shipped import RobotFiles, robot_files
from solfer_tools.cli.recordings.progress import progress
from solfer_tools.replay.differences import ReplayDifferences, differences, recorded_commands
from solfer_tools.replay.replay import Replay, make
from solfer_tools.replay.rows import LIFE, RecordedRows


def replayed(options: argparse.Namespace) -> tuple[Replay, ReplayDifferences]:
    """Replay what the options name.

    Raises:
        SolferError: The recording or the configuration cannot be used.
        SolferErrors: Several mistakes.
    """
    recorded = options.file, options.name, options.configuration, options.plugin or "", options.system
    with opened(*recorded) as replay:
        for _ in progress(replay.run(), len(replay.rows.times), "cycles"):
            pass
        return replay, differences(replay)


@contextmanager
def opened(
    file: Path,
    name: str,
    configuration: Path | None,
    plugin: str,
    system: str | None,
    *,
    changed: Callable[[Configuration], Configuration] = lambda each: each,
) -> Iterator[Replay]:
    """Make a replay, which has not run yet, and warn of what keeps it from being the same.

    Args:
        file: The recording.
        name: Plugin configuration to replay.
        configuration: Its main configuration; None: the recorded one.
        plugin: Recorded plugin; empty: that of the name, or the only one.
        system: `SM` or `HW` instead of the configuration's.
        changed: Changes the configuration.

    Raises:
        SolferError: The recording or the configuration cannot be used.
        SolferErrors: Several mistakes.
    """
    recording = read(file)
    for sentence in warnings_of(recording):
        print(f"warning: {sentence}", file=sys.stderr)
    rows = RecordedRows(recording, plugin or _plugin(recording, name), str(file))
    with tempfile.TemporaryDirectory() as folder:
        main = configuration or _written(rows, "configuration.yaml", Path(folder), expected="-c FILE")
        loaded = changed(load(main, name, system=system))
        with importable_beside(str(main)):
            yield make(loaded, generator_of(loaded), _files(loaded, rows, Path(folder)), rows=rows)


def warnings_of(recording: Recording) -> Iterator[str]:
    """Yield what keeps a replay from being the same."""
    for sentence in recording.missing:
        yield f"missing: {sentence}"
    if recording.lost:
        yield f"{recording.lost} cycles were not recorded: a component with a memory may differ from there"


def report(replay: Replay, found: ReplayDifferences) -> Iterator[str]:
    """Yield the lines about a replay."""
    rows = replay.rows
    span = rows.times[-1] - rows.times[0]
    yield f"{len(rows.times)} cycles over {span:.3f} s, {found.compared} compared, {found.numbers} numbers in each"
    if rows.running[0]:
        yield "the recording begins while the plugin runs: here the component starts in its first cycle"
    for text in replay.unrepeated:
        yield f"not repeated: {text}"
    if found.alone:
        cycle = int((replay.running != rows.running).argmax()) + 1
        yield f"in {found.alone} cycles only one of both ran, first in cycle {cycle}"
    for name in found.unmatched:
        yield f"only {'replayed' if name in replay.commands else 'recorded'}: {name}"
    if not found.different:
        yield f"the same commands, to {found.largest:.1g}" if found.compared else "no cycle was compared"
        return
    first = found.different[0]
    yield f"differs first: {first.column} of {first.channel} in cycle {first.cycle}, at {first.time:.3f} s"
    head = ("number", "channel", "first cycle", "at [s]", "largest")
    most = 20
    lines = [
        (each.column, each.channel, str(each.cycle), f"{each.time:.3f}", f"{each.largest:.3g} {each.unit}".rstrip())
        for each in found.different[:most]
    ]
    yield from aligned([head, *lines], "  ")
    if len(found.different) > most:
        yield f"  ... and {len(found.different) - most} more"
    unrepeated = list(replay.unrepeated_inputs())
    for text in unrepeated:
        yield f"cannot be repeated: {text}"
    if not unrepeated:
        yield "all inputs were repeated: it is the component that differs, or it reads the clock or random numbers"


def draw(replay: Replay, found: ReplayDifferences, path: Path, column: bool = False) -> None:
    """Draw the numbers that differ; if none does, the first ones. `column`: for a paper's column.

    Raises:
        RecordingError: The picture cannot be written.
    """
    from solfer_tools.review import MAX_REPLAY_ROWS, replay_page, save

    recorded = recorded_commands(replay)
    rows = replay.rows
    chosen = [(each.channel, each.column) for each in found.different[:MAX_REPLAY_ROWS]] or [
        (name, number) for name, channel in replay.commands.items() if name in recorded for number in channel.columns
    ][:MAX_REPLAY_ROWS]
    both = replay.running & rows.running
    tracks = []
    for name, number in chosen:
        pair = rows.values(recorded[name], (number,))[:, 0], replay.commands[name].column(number)
        theirs, ours = (np.where(both, values, np.nan) for values in pair)
        tracks.append((f"{number} of {name}", theirs, ours))
    title = f"{rows.plugin} of {Path(rows.where).name}, replayed"
    save([("replay", replay_page(title, rows.times - rows.times[0], tracks, column))], path)


def _plugin(recording: Recording, name: str) -> str:
    """Return the recorded plugin of the name, or the only one that was recorded."""
    known = [each.removesuffix(f"/{LIFE}") for each in recording.channels if each.endswith(f"/{LIFE}")]
    return known[0] if name not in known and len(known) == 1 else name


def _files(configuration: Configuration, rows: RecordedRows, folder: Path) -> RobotFiles:
    """Return the files of the robot: those of the configuration, or else the recorded ones."""
    found = robot_files(configuration)
    if found is not None:
        return found
    files = RobotFiles(_written(rows, "robot.urdf", folder, expected="a configuration with the file of its robot"))
    srdf = f"{rows.plugin}/robot.srdf" in rows.recording.attachments
    return replace(files, srdf=_written(rows, "robot.srdf", folder, expected="")) if srdf else files


def _written(rows: RecordedRows, name: str, folder: Path, expected: str) -> Path:
    """Write an attachment of the plugin to a file.

    Raises:
        RecordingError: There is none.
    """
    content = rows.recording.attachments.get(f"{rows.plugin}/{name}")
    if content is None:
        raise RecordingError(f"'{rows.plugin}/{name}' is not attached", where=rows.where, expected=expected)
    path = folder / name
    path.write_bytes(content)
    return path

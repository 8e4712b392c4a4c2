"""The actions of `solfer log`."""

import argparse
import sys
from collections.abc import Iterator

import numpy as np

from solfer.cli.columns import aligned
from solfer.errors import RecordingError, SolferError
from solfer.model.urdf.description import Description
from solfer.recording.model import Channel, Recording
from solfer.recording.reader import read
from solfer.recording.requests import grouped
from solfer.recording.selection import between, chooses, select, span
from solfer.recording.writer import save
from solfer_tools.cli.recordings.progress import progress


def info(options: argparse.Namespace) -> None:
    """Print what a recording holds."""
    recording = read(options.file, lambda channel: False)
    for line in _info(recording):
        print(line)
    print(f"file: {_size(options.file.stat().st_size)}")
    _warn(recording)


def cut(options: argparse.Namespace) -> None:
    """Write a part of a recording to another file."""
    if options.output.exists() and options.output.samefile(options.file):
        raise RecordingError(
            "a recording is not cut into itself", where=str(options.output), expected="the name of another file"
        )
    part = _chosen(options)
    save(part, options.output)
    print(f"{options.output}: {_size(options.output.stat().st_size)}")


def export(options: argparse.Namespace) -> None:
    """Write a recording, or a part of it, for other programs."""
    part = _chosen(options)
    if options.csv is not None:
        from solfer_tools.export.csv import save_csv

        for path in progress(save_csv(part, options.csv), len(part.channels), "CSV"):
            print(path)
    elif options.npz is not None:
        from solfer.recording.arrays import save_arrays

        save_arrays(part, options.npz)
        print(options.npz)
    else:
        from solfer_tools.export.bag import messages_in, save_bag

        for _ in progress(save_bag(part, options.bag), messages_in(part), "messages"):
            pass
        print(options.bag)


ACTIONS = {"info": info, "cut": cut, "export": export}


def _chosen(options: argparse.Namespace) -> Recording:
    """Return the part of a recording that was requested."""
    recording = read(options.file, chooses(options.columns))
    _warn(recording)
    start, end = span(recording)
    part = between(select(recording, options.columns, str(options.file)), options.begin, options.end, start=start)
    if not part.filled:
        raise RecordingError(
            "no row is left",
            where=str(options.file),
            expected=f"times from 0 to {end - start:g} s that overlap --from and --to",
        )
    return part


def _warn(recording: Recording) -> None:
    for sentence in recording.missing:
        print(f"warning: missing: {sentence}", file=sys.stderr)


def _info(recording: Recording) -> Iterator[str]:
    first, last = span(recording)
    rows = max((len(channel.times) for channel in recording.channels.values()), default=0)
    yield f"duration: {last - first:.3f} s, {rows} rows, {recording.lost} lost"
    yield from aligned([("channel", "columns", "rows", "rate [Hz]", "kind"), *map(_row, recording.channels.values())])
    for group in grouped(recording.events):
        event = group.first
        owner = group.first.plugin or "process"
        if group.count > 1:
            yield f"requests: {owner}: {group.counted(first)}"
        else:
            yield f"event at {event.time - first:.3f} s: {owner}: {event.kind} {event.text}".rstrip()
    for name, content in recording.attachments.items():
        yield f"attachment: {name} ({_size(len(content))})"
    for name, text in recording.metadata.items():
        yield f"{name}: {text}"


def _row(channel: Channel) -> tuple[str, ...]:
    step = np.median(np.diff(channel.times)) if len(channel.times) > 1 else 0.0
    rate = f"{1.0 / step:.1f}" if step else "-"
    return channel.name, str(len(channel.columns)), str(len(channel.times)), rate, channel.kind


def _size(count: float) -> str:
    """Write a number of bytes with a unit."""
    for unit in ("B", "kB", "MB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} GB"


def limits_of(recording: Recording, plugin: str) -> dict[str, tuple[float, float]]:
    """Return the least and the largest position of each joint of a plugin's attached URDF; none without one.

    Raises:
        ModelError: The attachment is no URDF.
    """
    name = f"{plugin}/robot.urdf"
    if name not in recording.attachments:
        return {}
    try:
        description = Description.from_text(recording.attachments[name].decode(errors="replace"), name)
    except SolferError as error:
        raise error.at(name) from None
    joints = description.moving_joints
    return {
        joint.name: (joint.lower, joint.upper)
        for joint in joints
        if joint.lower is not None and joint.upper is not None
    }

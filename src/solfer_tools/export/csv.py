"""A recording as CSV: a file for each channel."""

import csv
from collections.abc import Iterator
from pathlib import Path

from solfer.errors import RecordingError
from solfer.recording.model import Channel, Recording


def save_csv(recording: Recording, folder: Path) -> Iterator[Path]:
    """Write a file `<plugin>.<what>.csv` for each channel into a folder, which is made; yields each one.

    The first line has the names with their units, the first column the times [s]. Numbers are written so that they are
    read back to the bit.

    Raises:
        RecordingError: A file cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for channel in recording.channels.values():
            yield _written(channel, folder / f"{channel.name.replace('/', '.')}.csv")
    except OSError as error:
        raise RecordingError(
            f"the CSV files cannot be written: {error.strerror}",
            where=str(error.filename or folder),
            expected="a folder that you may write to",
        ) from error


def _written(channel: Channel, path: Path) -> Path:
    heads = (f"{name} [{unit}]" if unit else name for name, unit in zip(channel.columns, channel.units, strict=True))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("time [s]", *heads))
        for time, row in zip(channel.times.tolist(), channel.values.tolist(), strict=True):
            writer.writerow((repr(time), *map(repr, row)))
    return path

"""Files of the recordings that processes have left."""

from contextlib import closing
from pathlib import Path

from solfer.telemetry.drain import RecordDrain, writer_of
from solfer.telemetry.rows import RECORDING


def write_kept(folder: Path, target: Path) -> list[Path]:
    """Make a file, `<name>.mcap`, of each recording that was kept in a folder, and return the files.

    Raises:
        RecordingError: A file cannot be written.
    """
    files = []
    for place in sorted(path.parent for path in folder.rglob(RECORDING)):
        drain = RecordDrain(place)
        target.mkdir(parents=True, exist_ok=True)
        files.append(target / f"{place.name}.mcap")
        with closing(writer_of(files[-1], [drain])) as writer:
            drain.fill()
            writer.finish(drain.lost)
    return files

"""A recording as arrays for NumPy."""

import contextlib
import os
from pathlib import Path
from typing import Any

import numpy as np

from solfer.errors import RecordingError, writing
from solfer.recording.model import Recording


def save_arrays(recording: Recording, path: Path) -> None:
    """Write the channels to a NumPy file, `.npz`.

    Of each channel `<name>` is the array of its values, `<name>.time` that of its times and `<name>.columns` that of
    its columns; `lost` is the number of lost rows. An earlier file stays until the new one is complete.

    Raises:
        RecordingError: The file cannot be written.
    """
    draft = path.with_name(f"{path.name}.{os.getpid()}.new")
    made = False
    arrays: dict[str, Any] = {"lost": np.array(recording.lost)}
    for name, channel in recording.channels.items():
        arrays |= {name: channel.values, f"{name}.time": channel.times, f"{name}.columns": np.array(channel.columns)}
    try:
        with writing("the arrays", path, RecordingError):
            with draft.open("xb") as file:  # does not follow a link at this path
                made = True
                np.savez(file, **arrays)
            draft.rename(path)
    finally:
        with contextlib.suppress(OSError):
            if made:
                draft.unlink()

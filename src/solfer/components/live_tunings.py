"""Gains and dampings of the original's tunings, as live parameters."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from solfer.config.tasks.original import OriginalTaskTags, parts_of_tuning
from solfer.config.tasks.stack import StackRecord
from solfer.interfaces.declaration import LiveParameter
from solfer.tasks.building.build import ConfiguredTasks


def live_tunings(
    tags: OriginalTaskTags, record: StackRecord, configured: ConfiguredTasks, write: Callable[[np.ndarray], None]
) -> Iterator[LiveParameter]:
    """Yield the parameters of the tuning that counts.

    Args:
        tags: Tags of the component; their method `stack_record` returns what they mean.
        record: What it has returned.
        configured: The tasks that were made of that.
        write: Takes gains and dampings of the rows of all tasks, in the order of the levels, shape (2, rows).
    """
    numbers = partial(_numbers, configured)
    for name in parts_of_tuning(tags, record):
        yield LiveParameter(("tunnings", str(tags.tunning), name), write, numbers)


def _numbers(configured: ConfiguredTasks, tags: Any) -> np.ndarray:
    record = tags.stack_record()
    names = [name for level in record.levels for name in level]
    return np.array(
        [
            np.concatenate([configured.numbers(name, record.tasks[name], key) for name in names])
            for key in ("gain", "damping")
        ]
    )

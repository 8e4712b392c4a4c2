"""A progress bar for what takes more than a second, on a terminal only."""

import sys
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

Item = TypeVar("Item")
DELAY = 1.0
"""Time after which the progress is shown [s]."""

PERIOD = 0.1
"""Period in which it is shown [s]."""


def progress(items: Iterable[Item], total: int, unit: str) -> Iterator[Item]:
    """Yield items, and show on the terminal's stderr how many of `total` there were.

    Args:
        items: What is done, one after the other.
        total: How many there will be.
        unit: What they are.
    """
    width = 40  # of the bar, in characters
    following = time.monotonic() + DELAY
    shown = False
    count = 0
    for count, item in enumerate(items, 1):
        yield item
        if time.monotonic() >= following and sys.stderr.isatty():
            following = time.monotonic() + PERIOD
            shown = True
            full = width * count // max(1, total)
            print(
                f"\r[{'#' * full}{'.' * (width - full)}] {count} of {total} {unit}",
                end="",
                file=sys.stderr,
                flush=True,
            )
    if shown:
        print(f"\r{' ' * (width + 40)}\r", end="", file=sys.stderr, flush=True)

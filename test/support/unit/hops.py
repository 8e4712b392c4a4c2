"""Counts how deep the calls of a piece of work are nested."""

import sys
from dataclasses import dataclass


@dataclass
class Hop:
    """A call: how deep it is nested, 1 for the work itself, and the function's name."""

    depth: int
    name: str

    def __str__(self):
        return "  " * self.depth + self.name


def hops(work) -> list[Hop]:
    """Call `work` and list all Python functions, also compiled ones, that it called, in their order."""
    calls, depth = [], 0

    def note(frame, event, _argument):
        nonlocal depth
        if event == "call":
            depth += 1
            calls.append(Hop(depth, frame.f_code.co_qualname))
        elif event == "return":
            depth -= 1

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return calls

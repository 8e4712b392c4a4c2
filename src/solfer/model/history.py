"""What a pipe has measured since the last cycle, message by message."""

from collections.abc import Callable, Sequence

import numpy as np


class History:
    """All messages that a feedback accepted since the last cycle, oldest first; the State has the newest alone.

    The arrays are live, and filled again in each cycle: only their first `count` rows are of this one. Numbers are as
    measured: filters do not act on them.

    Args:
        interfaces: Interfaces of the State that are measured.
        dofs: The Robot's DoFs that are measured, shape (k,).
        size: Most messages of one cycle, N.

    Attributes:
        interfaces, dofs, size: See above.
        stamps: When the numbers were true, in the sender's clock, shape (N,) [s].
        arrivals: When they arrived, in the pipe's own clock, shape (N,) [s].
        values: The numbers in the State's units; NaN: the message lacks it. Shape (N, len(interfaces), k).
        forces: Specific forces of an accelerometer in the axes of the base, shape (N, 3) [m/s^2]; zeros: not measured.
        force: That of the newest message, shape (3,) [m/s^2]; live. The pipe writes it before it calls `add`.
        place: From the origin of the base to the accelerometer in these axes, shape (3,) [m]; live.
        sender: Name of the publisher of the newest message.
        count: Messages of this cycle; 0: nothing new.
        contradiction: Why their user finds the measurements wrong; empty: nothing contradicts them. The pipe refuses
            them until they and what contradicts them rest.
        others_rest: Whether that rests: as long as it moves, it may be what is wrong.
        dropped: Messages that were lost so far because there were more than N in a cycle, the oldest of them.
        unread: Those of them that were lost before the pipe read them.
    """

    def __init__(self, interfaces: Sequence[str], dofs: np.ndarray, size: int):
        self.interfaces = tuple(interfaces)
        self.dofs = dofs
        self.stamps = np.zeros(size)
        self.arrivals = np.zeros(size)
        self.values = np.zeros((size, len(self.interfaces), len(dofs)))
        self.forces = np.zeros((size, 3))
        self.force, self.place = np.zeros((2, 3))
        self.size = size
        self.count = self.dropped = self.unread = 0
        self.sender = ""
        self.contradiction = ""
        self.others_rest: Callable[[], bool] = lambda: True

    def clear(self) -> None:
        """Begin a cycle."""
        self.count = 0

    def add(self, stamp: float, arrival: float, values: np.ndarray, part: np.ndarray | None = None) -> None:
        """Add a message.

        Args:
            stamp: When its numbers were true, in the sender's clock [s].
            arrival: When it arrived, in the pipe's own clock [s].
            values: Its numbers, shape (len(interfaces), k).
            part: Indices of the DoFs that it has; None: all.
        """
        if self.count == self.size:
            self._drop_oldest()
        row = self.count
        self.stamps[row] = stamp
        self.arrivals[row] = arrival
        self.forces[row] = self.force
        if part is None:
            self.values[row] = values
        else:
            self.values[row] = np.nan
            self.values[row][:, part] = values[:, part]
        self.count += 1

    def _drop_oldest(self) -> None:
        for array in (self.stamps, self.arrivals, self.forces, self.values):
            array[:-1] = array[1:]
        self.count -= 1
        self.dropped += 1

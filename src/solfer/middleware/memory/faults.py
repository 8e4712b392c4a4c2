"""What goes wrong between two nodes, as an input of tests: delays, losses and order of messages, cycles left out.

Everything is drawn by one seed, for each topic and each loop by itself, so that the same description gives the same
run to the last bit, and a further topic changes none of the others.
"""

import math
import os
import random
from fnmatch import fnmatchcase

from pydantic import Field

from solfer.config import Record, read
from solfer.config.records.bounds import SEED, Bounds

DURATION: Bounds = {"ge": 0.0, "le": 10.0}
RATIO: Bounds = {"ge": 0.0, "le": 1.0}

TIME_TOLERANCE = 1e-9
"""Times that differ by less are one: sums of periods do not meet to the last bit [s]."""


class TopicFaultsRecord(Record):
    """What happens to the messages of a topic."""

    delay: float = Field(default=0.0, **DURATION, description="time that every message takes [s]")
    jitter: float = Field(default=0.0, **DURATION, description="largest time on top, uniform from zero on [s]")
    loss: float = Field(default=0.0, **RATIO, description="fraction of the messages that never arrive")
    bunch: float = Field(
        default=0.0,
        **DURATION,
        description="messages wait, and arrive together at multiples of this time [s]; 0: none do",
    )
    reorder: bool = Field(default=False, description="whether a message may overtake an earlier one of its topic")
    clock: float = Field(default=0.0, ge=-10.0, le=10.0, description="what is added to the sender's stamps [s]")


class LoopFaultsRecord(Record):
    """What happens to the cycles of a loop."""

    skip: float = Field(default=0.0, **RATIO, description="fraction of the cycles that are left out")
    stalls: float = Field(
        default=0.0, ge=0.0, le=100.0, description="how often the whole loop stands still, on average [1/s]"
    )
    stall: float = Field(
        default=0.0, **DURATION, description="longest time for which it does, uniform from zero on [s]"
    )


class FaultsRecord(Record):
    """The faults of a transport."""

    seed: int = Field(default=0, **SEED, description="seed of all that is drawn")
    topics: dict[str, TopicFaultsRecord] = Field(
        default_factory=dict, description="faults by topic; `*` in its name stands for anything; the first fit counts"
    )
    loop: LoopFaultsRecord = Field(default_factory=LoopFaultsRecord, description="faults of each loop")

    def of_topic(self, topic: str) -> TopicFaultsRecord | None:
        """Return the faults of a topic; None: it has none."""
        return next((faults for pattern, faults in self.topics.items() if fits(pattern, topic)), None)

    def draws(self, what: str) -> random.Random:
        """Return the numbers that are drawn for one thing: always the same for a seed and a name."""
        return random.Random(f"{self.seed} {what}")


class Line:
    """Transit of a topic's messages to their readers.

    Args:
        faults: What happens to them.
        draws: The numbers that are drawn; two for each message, whatever its faults are.
    """

    def __init__(self, faults: TopicFaultsRecord, draws: random.Random):
        self._faults = faults
        self._draw = draws.random
        self._last = -math.inf

    def due(self, now: float) -> float | None:
        """Return when a message of the time `now` arrives [s]; None: never."""
        faults = self._faults
        lost = self._draw() < faults.loss
        due = now + faults.delay + faults.jitter * self._draw()
        if lost:
            return None
        if not faults.reorder:
            due = max(due, self._last)
        if faults.bunch:
            due = max(due, math.ceil((due - TIME_TOLERANCE) / faults.bunch) * faults.bunch)
        self._last = due
        return due


class Stalls:
    """Which cycles of a loop are left out.

    Args:
        faults: What happens to them.
        draws: The numbers that are drawn.
        period: Time from one cycle to the next [s].
    """

    def __init__(self, faults: LoopFaultsRecord, draws: random.Random, period: float):
        self._faults = faults
        self._draw = draws.random
        self._chance = faults.stalls * period
        self._end = -math.inf

    def leaves_out(self, now: float) -> bool:
        """Return whether the cycle of the time `now` [s] is left out."""
        if now >= self._end and self._chance and self._draw() < self._chance:
            self._end = now + self._faults.stall * self._draw()
        return now < self._end or self._draw() < self._faults.skip


def fits(pattern: str, topic: str) -> bool:
    """Return whether a topic has the name `pattern`, in which `*` stands for anything."""
    return fnmatchcase(topic.lstrip("/"), pattern.lstrip("/"))


def read_faults(path: str | os.PathLike) -> FaultsRecord:
    """Read the file of a transport's faults, such as `config/transport/busy.yaml`.

    Raises:
        ConfigError: The file is missing, cannot be read or is not YAML, or a value does not fit.
        UnknownName: It has a key that there is not.
        SolferErrors: Several of these.
    """
    return read(path, FaultsRecord)

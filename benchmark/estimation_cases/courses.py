"""Courses on which estimators are measured: what is driven, in which world, and what is wrong there."""

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from solfer.config import FileRecord, Record, read

WORLDS = Path(__file__).resolve().parents[2] / "config" / "worlds"
HALF = math.pi


class Leg(NamedTuple):
    """A part of a course, in one kind of motion.

    Attributes:
        x, y: Way along and across the heading of its begin, as an arc of `turn` [m].
        turn: Turn of the heading [rad].
    """

    x: float = 0.0
    y: float = 0.0
    turn: float = 0.0


class Course(NamedTuple):
    """A course.

    Attributes:
        legs: Its parts.
        world: File of its world; None: a plane.
        lifted: Wheel that is lifted all the way; None: none is.
        spun: Speed that is added to that of a wheel while it is on `patch` [m/s], and the wheel; None: none is.
        pushed: Speed of the wheels after the legs, whatever stops the robot, and for how long [m/s, s]; None: none.
        patch: Smallest and largest x and y of the patch [m].
        goals: Most that figures of `filter` may be, by their names, at the shipped noise.
    """

    legs: tuple[Leg, ...]
    world: Path | None = None
    lifted: int | None = None
    spun: tuple[float, int] | None = None
    pushed: tuple[float, float] | None = None
    patch: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    goals: Mapping[str, float] = MappingProxyType({"end_error": 0.003, "height_error": 0.05, "heading_error": 0.5})

    def on_patch(self, x: float, y: float) -> bool:
        """Whether a place [m] is on the patch."""
        left, right, low, high = self.patch
        return left <= x <= right and low <= y <= high


def _closed(scale: float = 1.0) -> tuple[Leg, ...]:
    """Return a lap of 20 m that ends where it began: straight on, a circle, turns on the spot, sideways."""
    way, circle = 4.5 * scale, 2.0 * math.pi * scale
    there_and_back = (Leg(way), Leg(circle, turn=2.0 * math.pi), Leg(turn=HALF), Leg(way), Leg(turn=-HALF))
    side = 0.5 * (20.0 * scale - 2.0 * way - circle)
    return (*there_and_back, Leg(y=side), Leg(y=-side))


def _drawn(seed: int, length: float) -> tuple[Leg, ...]:
    """Draw ways of a length [m] altogether, on arcs, sideways and between turns on the spot."""
    random, legs, gone = np.random.default_rng(seed), [], 0.0
    while gone < length - 0.1:
        way = min(float(random.uniform(1.0, 5.0)), length - gone)
        kind = random.choice(4)
        if kind == 0:
            legs.append(Leg(turn=float(random.uniform(-HALF, HALF))))
            continue
        along = float(random.choice((1.0, 1.0, -1.0)))
        across = float(random.uniform(-HALF, HALF))
        turn = float(random.uniform(-1.0, 1.0)) * way
        made = (Leg(along * way), Leg(along * way, turn=turn), Leg(way * math.cos(across), way * math.sin(across)))
        legs.append(made[kind - 1])
        gone += way
    return tuple(legs)


_BACK_AND_FORTH = (Leg(5.0), Leg(-5.0)) * 2

COURSES: dict[str, Course] = {
    "loop": Course(_closed() * 5),
    "lap": Course(_closed()),
    "short": Course(_closed(0.25)),
    "patch": Course(
        _BACK_AND_FORTH,
        WORLDS / "ice.yaml",
        spun=(0.6, 1),
        patch=(1.5, 3.5, -1.0, 1.0),
        goals={"end_error": 0.005},
    ),
    "wall": Course((Leg(0.2),), WORLDS / "wall.yaml", pushed=(0.15, 7.0), goals={"end_error": 0.3}),
    "lifted": Course(_closed(), lifted=2, goals={"end_error": 0.003}),
    # a hundredth of the climb
    "ridge": Course((Leg(11.0),), WORLDS / "ridge.yaml", goals={"height_error": 0.0052}),
}
DRAWN = {"drawn": 100.0, "drawn_lap": 20.0}
"""Courses that are drawn by the seed, and their lengths [m]."""


def course(name: str, seed: int) -> Course:
    """Return a course by its name, such as `loop`; the seed draws those of `DRAWN`."""
    return Course(_drawn(seed, DRAWN[name])) if name in DRAWN else COURSES[name]


_Way = Annotated[float, Field(ge=-1000.0, le=1000.0)]


class LegRecord(Record):
    """A leg in a file; see `Leg`."""

    x: _Way = Field(default=0.0, description="way along the heading of its begin [m]")
    y: _Way = Field(default=0.0, description="way across it [m]")
    turn: _Way = Field(default=0.0, description="turn of the heading [rad]")

    @model_validator(mode="after")
    def _goes_somewhere(self) -> "LegRecord":
        if not (self.x or self.y or self.turn):
            raise ValueError("expected x, y or turn: this leg goes nowhere")
        return self


class CourseRecord(Record):
    """A file of a course."""

    legs: list[LegRecord] = Field(min_length=1, description="parts of the course")
    world: FileRecord | None = Field(default=None, description="file of its world")


def read_course(path: Path) -> Course:
    """Read the file of a course.

    Raises:
        SolferError: It is missing, or something in it is wrong.
    """
    record = read(path, CourseRecord)
    legs = tuple(Leg(leg.x, leg.y, leg.turn) for leg in record.legs)
    return Course(legs, None if record.world is None else record.world.location)

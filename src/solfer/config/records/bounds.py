"""Bounds of numbers that several records have in common: arguments of pydantic's `Field`.

Each number of a record has a lower and an upper bound: numbers beyond them mean nothing for a robot, or break
computations. All bounds are wider than any robot needs.
"""

from typing import Annotated, Any

from pydantic import Field

from solfer.config.records.robot_names import ComparedWith

Bounds = dict[str, Any]
"""Keyword arguments of `Field`."""

RATE: Bounds = {"ge": 1.0, "le": 4000.0}
"""Cycles of a loop [Hz]; a cycle of Python takes a fifth of a millisecond at best."""

TIMEOUT: Bounds = {"ge": 1e-3, "le": 3600.0}
"""Timeouts [s]."""

DURATION: Bounds = {"ge": 0.0, "le": 60.0}
"""Times of a motion, or of a change [s]; zero: none."""

COUNT: Bounds = {"ge": 0, "le": 1_000_000}
"""Numbers of things."""

SEED: Bounds = {"ge": 0, "le": 2**32 - 1}
"""Seeds of random numbers."""

LENGTH: Bounds = {"ge": 1e-4, "le": 1e4}
"""Lengths of things [m]."""

COORDINATE: Bounds = {"ge": -1e4, "le": 1e4}
"""Coordinates of positions in a world [m], and of joints with many revolutions [rad]."""

OFFSET: Bounds = {"ge": -100.0, "le": 100.0}
"""Coordinates of places on a link [m]."""

DIRECTION: Bounds = {"ge": -1000.0, "le": 1000.0}
"""Components of vectors and rows that are made for their direction, of any length."""

NOISE: Bounds = {"ge": 0.0, "le": 1e4}
"""Standard deviations, in the unit of the measured quantity."""

GAIN: Bounds = {"ge": 0.0, "le": 1e5}
"""Stiffness [Nm/rad, N/m] and damping [Nms/rad, Ns/m] that joints are given."""

Name = Annotated[str, Field(min_length=1)]
"""A name, or another text that is not empty."""

Offset = Annotated[tuple[Annotated[float, Field(**OFFSET)], ...], Field(min_length=3, max_length=3)]
"""A place on a link [m]."""

Place = Annotated[
    tuple[Annotated[float, Field(**COORDINATE)], ...], Field(min_length=3, max_length=3), ComparedWith("world")
]
"""A place in a world [m]."""

Direction = Annotated[tuple[Annotated[float, Field(**DIRECTION)], ...], Field(min_length=3, max_length=3)]
"""A vector that is made for its direction, of any length."""

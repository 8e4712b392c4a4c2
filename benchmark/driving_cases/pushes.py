"""Pushes at the pelvis of CENTAURO that stands, growing until it tips over."""

import math
import sys
import tempfile
from contextlib import closing
from pathlib import Path

import numpy as np
from driving_cases.world import PERIOD, World

from solfer.config import load
from solfer.errors import SolferError
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import Plugin, Registry, generate

DIRECTIONS, DURATION = 8, 0.2
"""Directions of pushes, and how long each takes [s]."""

STAND, WATCH = 0.6, 4.0
"""Time before a push, and after it [s]."""

COARSE, FINE, MOST = 20.0, 5.0, 400.0
"""Steps of the impulse, the largest one [Ns]."""

LINK = "pelvis"


class PushedWorld(World):
    """CENTAURO that stands, with any plugin for `wheeled_motion`; see `World`."""

    registered = "NwheelsZMPII"

    def _plugin(self, file: Path, name: str) -> Plugin:
        found = Registry().find(self.registered)
        return generate(load(file, name), MemoryMiddleware(self.bus, name), found)


def survives(direction: float, impulse: float, tags: str, seed: int = 0) -> bool:
    """Whether the robot stands after a push in a direction [rad] with an impulse [Ns]."""
    with tempfile.TemporaryDirectory() as folder, closing(PushedWorld(Path(folder), tags)) as world:
        world.bus.every(PERIOD, world.cycle)
        try:
            world.run(STAND + 0.001 * seed)
            force = impulse / DURATION * np.array((math.cos(direction), math.sin(direction), 0.0))
            world.simulation.push(LINK, force, DURATION)
            for _ in range(round(WATCH / 0.1)):
                world.run(0.1)
                if world.fallen:
                    return False
        except SolferError as error:
            print(error, file=sys.stderr)
            return False
    return True


def largest(direction: float, tags: str, seed: int = 0) -> float:
    """Return the largest impulse that the robot survives in a direction, in steps of FINE [Ns]."""
    low, high = 0.0, COARSE
    while high <= MOST and survives(direction, high, tags, seed):
        low, high = high, high * 1.5
    while high - low > FINE:
        middle = 0.5 * (low + high)
        if survives(direction, middle, tags, seed):
            low = middle
        else:
            high = middle
    return low


def polar(tags: str, seed: int = 0) -> list[float]:
    """Return the largest impulses that the robot survives in all directions [Ns]."""
    found = []
    for index in range(DIRECTIONS):
        found.append(largest(2.0 * math.pi * index / DIRECTIONS, tags, seed))
        print(f"{360 * index // DIRECTIONS} degrees, {tags}: {found[-1]:.0f} Ns", file=sys.stderr, flush=True)
    return found

"""Pushes at the pelvis of CENTAURO that stands, growing until it tips over."""

import json
import math
import sys
import tempfile
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from driving_cases.driven import driven
from driving_cases.errors import wrong_robot
from driving_cases.world import PERIOD, World
from matplotlib.figure import Figure

from solfer.errors import SolferError

DIRECTIONS, DURATION = 8, 0.2
"""Directions of pushes, and how long each takes [s]."""

STAND, WATCH = 0.4, 2.0
"""Time before a push, and after it [s]."""

FIRST, RATIO, LEAST, MOST = 200.0, 1.15, 20.0, 2000.0
"""The first impulse that is tried, the ratio of one to the next, and their range, which is the world's [Ns]."""

LINK = "pelvis"

TAGS = "base: center_of_mass, balance: center_of_mass, margins: [0.2], workspaces: [0.75]"
"""Tags of the component."""


class PushedWorld(World):
    """CENTAURO that stands, with any plugin for `wheeled_motion`; see `World`."""

    registered = "NwheelsZMPII"


def survives(direction: float, impulse: float, tags: str, seed: int = 0, **options: Any) -> bool:
    """Whether the robot stands after a push in a direction [rad] with an impulse [Ns]; `options` are of a `World`."""
    with tempfile.TemporaryDirectory() as folder, closing(PushedWorld(Path(folder), tags, **options)) as world:
        world.bus.every(PERIOD, world.cycle)
        try:
            world.run(STAND + 0.001 * seed)
            force = impulse / DURATION * np.array((math.cos(direction), math.sin(direction), 0.0))
            world.simulation.pushes.add(LINK, force, np.zeros(3), DURATION)
            for _ in range(round(WATCH / 0.1)):
                world.run(0.1)
                if world.fallen:
                    return False
        except SolferError as error:
            print(error, file=sys.stderr)
            return False
    return True


def largest(direction: float, tags: str, seed: int = 0, **options: Any) -> float:
    """Return the largest impulse that the robot survives in a direction, to within RATIO [Ns]."""
    impulse = FIRST
    if survives(direction, impulse, tags, seed, **options):
        while impulse * RATIO <= MOST and survives(direction, impulse * RATIO, tags, seed, **options):
            impulse *= RATIO
        return impulse
    while impulse > LEAST:
        impulse /= RATIO
        if survives(direction, impulse, tags, seed, **options):
            return impulse
    return 0.0


def polar(tags: str, seed: int = 0, **options: Any) -> list[float]:
    """Return the largest impulses that the robot survives in all directions [Ns]."""
    found = []
    for index in range(DIRECTIONS):
        found.append(largest(2.0 * math.pi * index / DIRECTIONS, tags, seed, **options))
        print(f"{360 * index // DIRECTIONS} degrees, {tags}: {found[-1]:.0f} Ns", file=sys.stderr, flush=True)
    return found


def compare(picture: Path, tags: str, seed: int, **options: Any) -> bool:
    """Push in all directions, with and without the reaction; print the impulses, and draw them into a picture."""
    tags = ", ".join(filter(None, (TAGS, tags)))
    options |= wrong_robot(seed, driven().urdf)
    found = {name: polar(f"{tags}, reactive: {name}", seed, **options) for name in ("false", "true")}
    for index, pair in enumerate(zip(found["false"], found["true"], strict=True)):
        print(json.dumps({"direction": 360 // DIRECTIONS * index, "without": pair[0], "with": pair[1]}), flush=True)
    figure = Figure(figsize=(6.0, 6.0))
    axes = figure.add_subplot(projection="polar")
    angles = 2.0 * np.pi * np.arange(DIRECTIONS + 1) / DIRECTIONS
    for name, label in (("false", "without"), ("true", "with")):
        axes.plot(angles, [*found[name], found[name][0]], "o-", label=f"{label} `reactive`")
    axes.set_title("Largest impulse at the pelvis that the robot survives [Ns]")
    axes.legend(loc="lower right")
    figure.savefig(picture)
    return True

"""Fig. 5 on a computer that gives its processes a quarter of the time they need: it rests, stands, and goes on."""

import math
from contextlib import closing

import numpy as np
import pytest
from support.paper.full_control import Nodes, course

from solfer.middleware.memory import Bus
from solfer.plugins import PluginState
from solfer_tools.scenarios import read_scenario

DRIVES, STARVED, LATER = 2.5, 3.0, 2.5
"""Time before the computer is busy, while it is, and after that [s]."""


class Computer:
    """A computer that is busy for a while: loops get 25 ms of each 100 ms, or a quarter of stretches that a seed draws.

    Attributes:
        is_busy: Whether it is.
    """

    def __init__(self, seed):
        self.is_busy = False
        self._draw = None if seed is None else np.random.default_rng(seed)
        self._until = (0.0, 0.0)

    def starves(self, time):
        """Return whether the loops have to wait at a time [s]."""
        if not self.is_busy:
            return False
        if time >= self._until[1]:
            works = 0.025 if self._draw is None else self._draw.uniform(0.005, 0.045)
            self._until = time + works, time + 4.0 * works
        return time >= self._until[0]


class OverloadedDrive:
    """Watches the robot while a course is driven, and makes the computer busy in the middle of it."""

    def __init__(self, world, computer):
        self.world, self.computer = world, computer
        self.begin, self.tilt, self.rows = world.bus.time, 0.0, []

    def look(self, waving):
        """Note the speeds of base and hand, with the time [s]."""
        now, time = self.world.simulation.state.now, self.world.bus.time - self.begin
        self.computer.is_busy = DRIVES < time < DRIVES + STARVED
        self.tilt = max(self.tilt, math.acos(min(1.0, now.rotation("pelvis")[2, 2])))
        self.rows.append((time, *now.position("pelvis")[:2], *self.world.hands()["left"]))
        if time > DRIVES + STARVED + LATER:
            raise StopIteration

    def speeds(self, begin, end):
        """Return the mean speeds of base and hand from one time to another [m/s]."""
        rows = np.array(self.rows)
        part = rows[(rows[:, 0] >= begin) & (rows[:, 0] <= end)]
        time, *way = part[-1] - part[0]
        return np.linalg.norm(way[:2]) / time, np.linalg.norm(way[2:]) / time


@pytest.mark.daily(1)
@pytest.mark.parametrize("seed", [None, *range(50)])
def test_it_rests_while_its_loops_starve_and_goes_on(seed, tmp_path, monkeypatch):
    """Base and hand slow down while loops get no computing time, and go on after it; the robot does not tilt."""
    computer, every = Computer(seed), Bus.every

    def starved(self, period, work, start=None, cycles=False):
        gated = (lambda: None if computer.starves(self.time) else work()) if cycles else work
        every(self, period, gated, start, cycles)

    monkeypatch.setattr(Bus, "every", starved)
    file = tmp_path / "course.yaml"
    file.write_text(course(3.0, 0.0, 0.2, 0.4))
    with closing(Nodes(tmp_path)) as world:
        world.run(2.5)
        driver = OverloadedDrive(world, computer)
        with pytest.raises(StopIteration):
            world.play(read_scenario(file), driver.look)
        busy, free = DRIVES + STARVED, DRIVES + STARVED + LATER
        assert driver.speeds(DRIVES - 0.5, DRIVES)[0] == pytest.approx(0.2, abs=0.01)
        base, hand = driver.speeds(DRIVES + 2.0, busy)
        assert base < 0.03 and hand < 0.05
        assert driver.speeds(busy + 2.0, free)[0] > 0.15
        assert math.degrees(driver.tilt) < 3.0
        assert {plugin.life for plugin in world.plugins.values()} == {PluginState.RUNNING}
        assert all(plugin.overload.pace > 0.5 for plugin in world.plugins.values())

"""What counts as a jump of the base's estimate, and what it makes of references."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from solfer.config.records.modules import BaseJumpRecord
from solfer.numerics.base_chart import BaseChart
from solfer.plugins.base_jumps import BaseJumps

PERIOD = 0.005


@pytest.fixture
def base():
    """Return a robot of which only the base counts, and what watches it."""
    robot = SimpleNamespace(kinematics=SimpleNamespace(base=BaseChart()), state=SimpleNamespace(position=np.zeros(9)))
    robot.state.position[:] = 0.1, 0.2, 0.8, 0.05, -0.1, 3.0, 1.0, 2.0, 3.0
    return robot.state.position, BaseJumps("legs", robot, BaseJumpRecord())


@pytest.mark.parametrize("gap", [1, 2, 30])
def test_motions_are_no_jumps(base, gap):
    """Neither those at the largest speeds, nor a turn beyond half a turn, nor what comes after a silence."""
    position, jumps = base
    for cycle in range(600):
        assert jumps.find(PERIOD) is None
        if cycle % gap == gap - 1:
            position[:3] += 1.1 * gap * PERIOD
            position[5] = math.remainder(position[5] + 2.9 * gap * PERIOD, 2.0 * math.pi)
    assert jumps.count == 0


@pytest.mark.parametrize("seed", range(20))
def test_a_jump_is_found_and_moves_what_is_beside_the_base(base, seed, caplog):
    """A place that is fixed as seen from the base is still so afterwards, but for what leans."""
    position, jumps = base
    draw = np.random.default_rng(seed)
    chart, before = BaseChart(), position[:6].copy()
    seen = draw.uniform(-1.0, 1.0, 3)
    place = before[:3] + chart.to_rotation(before) @ seen
    assert jumps.find(PERIOD) is None
    turn = draw.uniform(0.3, 3.0) * draw.choice((-1.0, 1.0))
    rotation = np.array(
        ((math.cos(turn), -math.sin(turn), 0.0), (math.sin(turn), math.cos(turn), 0.0), (0.0, 0.0, 1.0))
    )
    chart.from_rotation(before[:3] + draw.uniform(-5.0, 5.0, 3), rotation @ chart.to_rotation(before), position[:6])
    move = jumps.find(PERIOD)
    assert move is not None and move.yaw == pytest.approx(turn, abs=1e-9)
    move.move(place)
    np.testing.assert_allclose(place, position[:3] + chart.to_rotation(position[:6]) @ seen, atol=1e-9)
    assert "legs: the estimate of the base has jumped by" in caplog.text
    assert jumps.find(PERIOD) is None and jumps.count == 1


@pytest.mark.parametrize(("axis", "size"), [(0, 0.07), (2, -0.07), (3, 0.13), (4, -0.13), (5, 0.13)])
def test_each_axis_counts(base, axis, size):
    position, jumps = base
    position[axis] += 0.7 * size
    assert jumps.find(PERIOD) is None
    position[axis] += size
    assert jumps.find(PERIOD) is not None
    position[axis] -= size
    jumps.restart()
    assert jumps.find(PERIOD) is None

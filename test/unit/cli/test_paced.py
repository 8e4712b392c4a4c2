"""The pace of what runs in memory."""

import pytest

from solfer_tools.cli.view.paced import PacedClock


@pytest.mark.parametrize(
    "speed, late, passes", [(1.0, 0.0, 0.05), (4.0, 0.0, 0.2), (0.1, 0.0, 0.005), (1.0, 3.0, 0.05)]
)
def test_time_passes_in_memory_at_its_speed(monkeypatch, speed, late, passes):
    """A lag is not made up for; what passes is measured."""
    times = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: times[0])
    monkeypatch.setattr("time.sleep", lambda duration: times.append(times.pop() + duration))
    steps = []
    clock = PacedClock(steps.append, 0.05, call=None)
    clock.speed = speed
    for cycle in range(1, 31):
        clock.sleep_until(100.0 + late + 0.05 * cycle)
    assert steps == pytest.approx(30 * [passes])
    assert clock.measured == pytest.approx(speed, rel=0.1) or late

"""Plugins that are switched on and off again and again leave nothing behind; longer: benchmark/switching.py."""

from support.realtime.switching import STAY, SwitchedLayer, held

SWITCHES = 40


def test_random_switches_leave_nothing(tmp_path):
    before = held()
    layer = SwitchedLayer(tmp_path)
    layer.switch_each()
    first = layer.held()
    layer.switch_at_random(SWITCHES)
    assert layer.held() == first and first["leases"] == 0
    assert layer.refused > SWITCHES // 10  # two that claim the same
    assert all(managed.starts > SWITCHES // 10 and not managed.aborts for managed in layer.executor.plugins)
    assert not layer.world.simulation.lower_level.refusals
    layer.close()
    assert layer.segments() == STAY
    del layer
    assert held() == before

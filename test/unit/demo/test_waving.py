"""Hands that wave go along circles against each other, after they have risen."""

import numpy as np
import pytest

from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer_tools.demo.waving import Waving

HANDS = {"left": np.array((0.5, 0.3, 0.1)), "right": np.array((0.5, -0.3, 0.1))}


def test_hands_are_mirror_images_half_a_turn_apart():
    """The hands wave where the demonstration says, as wide as it says, and never both on the same side."""
    bus = Bus()
    reader = MemoryMiddleware(bus, "hands").reader("hands/left/reference", "geometry_msgs/PointStamped")
    waving = Waving(MemoryMiddleware(bus, "demo"), "hands", HANDS)
    waving.send(0.0)
    assert all((waving.desired[name] == place).all() for name, place in HANDS.items())
    ways = []
    for time in 2.0 + 3.0 * np.linspace(0.0, 1.0, 41):
        waving.send(time)
        ways.append([waving.desired[name] - place for name, place in HANDS.items()])
    left, right = np.swapaxes(ways, 0, 1)
    assert reader.read() and reader.message.values == pytest.approx(waving.desired["left"])
    assert left[:, 1:] - left[:, 1:].mean(axis=0) == pytest.approx(
        (right[:, 1:] - right[:, 1:].mean(axis=0)) * (1.0, -1.0), abs=0.01
    )
    assert np.ptp(left, axis=0) == pytest.approx((0.0, 0.2, 0.2), abs=0.01)
    assert left[:, 1].mean() == pytest.approx(-right[:, 1].mean(), abs=0.01) and left[:, 1].mean() > 0.05

"""Times on the wire."""

import pytest

from solfer.middleware.ros.node.clock import ros_time


@pytest.mark.parametrize("milliseconds", [0, 1, 3, 300, 12170, 86_400_001])
def test_a_time_is_whole_nanoseconds(milliseconds):
    assert ros_time(milliseconds * 1e-3).to_nsec() == milliseconds * 1_000_000

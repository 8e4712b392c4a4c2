"""Fig. 5 on the course of the demonstration: a layer behind its bridge sends what nodes send, on the virtual clock.

`test/ros/figure_5_lockstep_test.py` compares nodes of ROS with the same.
"""

from contextlib import closing

import numpy as np
import pytest
from support.paper.one_schedule import ScheduledLayer, ScheduledNodes

DURATION = 4.0  # [s]


@pytest.mark.soak
def test_a_layer_sends_what_nodes_send(tmp_path):
    with closing(ScheduledNodes()) as memory, closing(ScheduledLayer(tmp_path)) as layer:
        for world in (memory, layer):
            world.play(DURATION)
            assert world.outside.navigation.elapsed > 0.5 * DURATION
        assert layer.names == memory.names and len(layer.sent) == len(memory.sent) == round(200.0 * DURATION)
        np.testing.assert_allclose(layer.sent, memory.sent, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(layer.simulation.q, memory.simulation.q, rtol=0.0, atol=1e-9)
    moved = dict(zip(memory.names, np.ptp(memory.sent[100:], axis=0), strict=True))
    for controller, field, joint in (
        ("velocity_controller", "velocity", "j_wheel_1"),
        ("position_controller", "position", "j_arm1_1"),
        ("position_controller", "position", "ankle_yaw_1"),
    ):
        assert moved[controller, field, joint] > 0.1

"""What several tests of plugin refused share."""

import numpy as np
import pytest
from support.plugins.plugin import WHEELS

TOLERANCE = 0.05  # [rad], what springs give way to the weight when the robot is held anew


def logged(caplog, text):
    """Return what plugins logged with `text` in it."""
    return [
        record.getMessage()
        for record in caplog.records
        if record.name.startswith("solfer.plugins") and text in record.getMessage()
    ]


def speeds(world):
    """Read the speeds of the wheels [rad/s]."""
    return world.simulation.v[[world.simulation.kinematics.dofs.index(name) for name in WHEELS]]


def joints(world):
    """Read the positions of the joints on springs [rad]."""
    return world.simulation.q[world.simulation.lower_level.controllers["position_controller"].dofs].copy()


def moves_again(world):
    """Check that the plugin obeys a request: wheels turn and a joint moves."""
    request = {"velocities": (1.0,) * 4 + (0.0,), "positions": (0.0,) * 4 + (0.2,)}
    assert world.ask(joints=(*WHEELS, "neck_yaw"), **request).success
    world.run(1.5)
    assert np.abs(speeds(world) - 1.0).max() < 0.1
    assert world.simulation.q[world.simulation.kinematics.dofs.index("neck_yaw")] == pytest.approx(0.2, abs=0.02)

"""Joints that follow others in the simulator."""

from contextlib import closing

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.unit.mimics import FOLLOWERS, URDF, load

from solfer.errors import CommandRefused
from solfer.simulation import Simulation
from solfer.transport.messages import JointMessage


@pytest.fixture
def simulation(tmp_path):
    (tmp_path / "grip.urdf").write_text(URDF)
    gains = ", ".join(f"{name}: {{stiffness: 0.0, damping: 0.0}}" for name in ("lift", "elbow", "grip", "curl"))
    (tmp_path / "gains.yaml").write_text(f"grip: {{gains: {{{gains}}}}}")
    (tmp_path / "robot.yaml").write_text(
        "{name: grip, urdf: grip.urdf, gains: gains.yaml, lower_level: {overspeed: 0}}"
    )
    with closing(Simulation.from_file(tmp_path / "robot.yaml")) as simulation:
        yield simulation


def test_followers_move_by_the_folded_dynamics(simulation):
    """Pinocchio's folded dynamics predict every acceleration, and mimic joints keep their ratio to rounding."""
    robot = load()
    followers = [robot.dof(name) for name in FOLLOWERS]
    assert simulation.lower_level.controllers["joints"].joints == ("lift", "curl", "elbow", "grip")
    for _ in range(100):
        robot.state.position[:], robot.state.velocity[:] = simulation.q, simulation.v
        robot.dynamics.update()
        free = robot.dynamics.inertia_inverse @ -robot.dynamics.bias
        free[followers] = [ratio * free[robot.dof(leader)] for leader, ratio, _ in FOLLOWERS.values()]
        before = simulation.v.copy()
        simulation.step()
        assert_allclose((simulation.v - before) / 1e-3, free, atol=0.05 * np.abs(free).max())
        for name, (leader, ratio, offset) in FOLLOWERS.items():
            expected = ratio * simulation.q[robot.dof(leader)] + offset
            assert simulation.q[robot.dof(name)] == pytest.approx(expected, abs=1e-12)
    assert np.abs(simulation.v).max() > 0.1


def test_commands_for_followers_are_refused(simulation):
    with pytest.raises(CommandRefused, match="joint 'spread' has no drive"):
        simulation.lower_level.accept("joints", JointMessage(("grip", "spread"), effort=np.zeros(2)))

"""Ten thousand random messages to the simulated CENTAURO: no crash, and no motion beyond limits."""

import numpy as np
import pytest
from support.integration.world import STEP

from solfer.lower_level import LowerLevelRecord
from solfer.lower_level.safeguard.safeguard import Safeguard
from solfer.middleware.memory import MemoryMiddleware
from solfer.transport import JointMessage

MESSAGES = 10_000
EACH_STEP = 10
HUGE = (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e18, 1e-308, 0.0, -0.0)
FIELDS = ("position", "velocity", "effort", "stiffness", "damping")


def numbers(rng, size):
    """Draw mostly plausible numbers, and some wrong ones."""
    values = rng.normal(scale=rng.choice([0.01, 1.0, 100.0]), size=size)
    strange = rng.random(size) < rng.choice([0.0, 0.0, 0.3])
    values[strange] = rng.choice(HUGE, size=int(strange.sum()))
    return values


def message(rng, joints):
    """Known, unknown and duplicate names; arrays that need not be as long as these."""
    known = rng.choice(joints, size=rng.integers(0, min(6, len(joints) + 1)), replace=rng.random() < 0.2)
    names = tuple(map(str, known)) + (("no_such_joint", "")[: rng.integers(0, 3)] if rng.random() < 0.2 else ())
    fields = {}
    for field in rng.choice(FIELDS, size=rng.integers(0, 4), replace=False):
        size = len(names) if rng.random() < 0.8 else rng.integers(0, 9)
        fields[str(field)] = numbers(rng, size)
    return JointMessage(names, **fields)


@pytest.mark.soak
def test_ten_thousand_random_messages(world):
    """Targets, velocities and drives keep their limits at every step, and the state stays finite.

    Some messages must be accepted, or the limits would not be tested at all.
    """
    rng, simulation = np.random.default_rng(11), world.simulation
    lower_level, kinematics = simulation.lower_level, simulation.kinematics
    # that joints swing wildly is the purpose here: it would hold, and refuse everything from then on
    lower_level.safeguard = Safeguard(kinematics, LowerLevelRecord(tilt=0.0, overspeed=0.0))
    nodes = [MemoryMiddleware(world.bus, f"hostile_{number}") for number in range(3)]
    writers = [
        (controller, node.writer(f"{name}/command", "solfer/JointCommand"))
        for name, controller in lower_level.controllers.items()
        for node in nodes
    ]
    springs = lower_level.controllers["position_controller"]
    before = springs.target.copy()
    for _ in range(MESSAGES // EACH_STEP):
        for _ in range(EACH_STEP):
            controller, writer = writers[rng.integers(len(writers))]
            writer.write(message(rng, controller.joints))
        world.run(STEP)
        assert np.all(np.abs(springs.target - before) <= springs.limits.velocity * STEP * (1.0 + 1e-9))
        before[:] = springs.target
        assert np.all((springs.target >= springs.limits.lower - 1e-6) & (springs.target <= springs.limits.upper + 1e-6))
        assert np.all(
            np.abs(lower_level.drives.two_mass.drive)
            <= np.where(np.isfinite(kinematics.effort_limit), kinematics.effort_limit, np.inf)
        )
        assert np.isfinite(simulation.q).all() and np.isfinite(simulation.v).all()
        for controller in lower_level.controllers.values():
            assert np.all(np.abs(controller.velocity) <= controller.limits.velocity)
    accepted = MESSAGES - lower_level.refused
    assert accepted > 100 and lower_level.refused > 1000  # both kinds were among them
    assert set(lower_level.refusals) == {node.name for node in nodes}

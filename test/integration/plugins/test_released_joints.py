"""Arms that torques alone carry, on the virtual clock: whatever ends their plugin, they stay where they are."""

import numpy as np
import pytest
from support.integration.carried import HANDS, CarriedWorld, free_arms
from support.integration.world import ROBOT
from support.plugins.plugin_claims import kill, owners

from solfer.model.urdf.description import Description

LINKS = [f"arm{arm}_{link}" for arm in (1, 2) for link in range(2, 8)]
ENDS = {
    "stop": lambda world, plugin: plugin.stop(),
    "abort": lambda world, plugin: plugin.abort(),
    "kill": lambda world, plugin: kill(plugin),
    "lease": lambda world, plugin: world.asleep.add(plugin.name),
}


def drawn(seed):
    """Draw positions of the arms' joints from the middle two thirds of their ranges [rad]."""
    draw = np.random.default_rng(seed)
    joints = Description.from_file(ROBOT / "centauro.urdf").joints
    ranges = {
        name: (joint.lower, joint.upper) for name, joint in joints.items() if "_arm" in name and joint.lower is not None
    }
    return {name: low + draw.uniform(1 / 6, 5 / 6) * (high - low) for name, (low, high) in ranges.items()}


def places(world):
    """Return the places of the arms' links, shape (k, 3) [m]."""
    return np.array([world.simulation.state.now.position(link) for link in LINKS])


@pytest.mark.daily(2)
@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("end", ENDS)
def test_arms_without_springs_stay(tmp_path, end, seed):
    """When their plugin ends, springs take arms over that gravity compensation alone carried: no fall, no jump."""
    world = CarriedWorld(joints=drawn(seed))
    try:
        plugin = world.plugin("soft_compensation", free_arms(tmp_path))
        world.run(1.5)
        controller = world.simulation.lower_level.controllers["position_controller"]
        arms = [index for index, joint in enumerate(controller.joints) if "arm" in joint]
        assert not controller.stiffness[arms].any() and np.abs(controller.effort[arms]).max() > 5.0
        ENDS[end](world, plugin)
        before, gone, speeds = places(world), [], []
        world.bus.every(
            0.001, lambda: (gone.append(places(world) - before), speeds.append(world.simulation.v[6:].copy()))
        )
        world.run(1.5)
        assert not any(owners(world).values()) and (controller.stiffness[arms] > 0.0).all()
        assert np.linalg.norm(gone, axis=-1).max() < 0.05
        assert (np.abs(speeds) < world.simulation.kinematics.velocity_limit[6:]).all()
        assert np.abs(speeds[1000:]).max() < 0.05
        world.simulation.pushes.add(HANDS[0], (0.0, 6.0, 8.0), (0.0, 0.0, 0.0), 1.0)
        world.run(1.0)
        assert np.linalg.norm(gone, axis=-1).max() < 0.05
    finally:
        world.close()

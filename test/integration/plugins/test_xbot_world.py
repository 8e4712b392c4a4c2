"""The same plugins and the same simulated robot in memory and in shared memory: to the last bit the same motion."""

import numpy as np
import pytest
from support.integration.world import World
from support.integration.xbot_world import XbotWorld

from solfer.plugins import PluginState

LOWER_BODY = "mammal_wide_high"
FIGURES = {
    "joint_states": ({"joint_states": {"state": LOWER_BODY}}, ("joint_states",)),
    "Fig. 4": (
        {
            "upper_body": {"joints": ("torso_yaw", "neck_pitch"), "positions": (0.3, 0.2)},
            "lower_body": {"state": LOWER_BODY},
        },
        ("upper_body", "lower_body", "whole_body"),
    ),
}
"""What is asked of which plugin, and all plugins."""


def moved(world: World, figure: str) -> tuple[np.ndarray, list[tuple[str, ...]]]:
    """Joints and base, sampled while plugins move CENTAURO, and the DoFs of each plugin's Robot."""
    requests, names = FIGURES[figure]
    plugins, rows = [world.plugin(name) for name in names], []
    world.run(0.3)
    assert all(plugin.life is PluginState.RUNNING for plugin in plugins)
    for name, request in requests.items():
        assert world.ask(f"{name}/trajectory", **request).success
    robot = plugins[-1].robot
    for _ in range(40):
        world.run(0.05)
        rows.append(np.concatenate((world.simulation.q, robot.command.position, robot.state.velocity)))
    world.close()
    return np.array(rows), [plugin.robot.dofs for plugin in plugins]


@pytest.mark.daily(1)
@pytest.mark.parametrize("figure", FIGURES)
def test_both_memories_agree_bitwise(tmp_path, figure):
    (in_memory, dofs), (shared, shared_dofs) = (moved(world, figure) for world in (World(), XbotWorld(tmp_path)))
    assert dofs == shared_dofs
    assert np.ptp(in_memory, axis=0).max() > 0.25  # it moved
    np.testing.assert_array_equal(shared, in_memory)

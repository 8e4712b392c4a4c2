"""Fig. 2 of the paper: the hands of a fixed upper body follow references, seen from the pelvis."""

import contextlib

import numpy as np
from support.integration.world import World
from support.integration.xbot_world import XbotWorld

from solfer.plugins import PluginState

WAYS = {"left": (0.0, 0.1, 0.15), "right": (0.1, -0.1, 0.1)}  # [m]


def commands(world):
    """Let both hands move; what the plugin commands cycle by cycle, and where its hands are in the simulation."""
    plugin = world.plugin("manipulation")
    sent, cycle = [], plugin.outputs.send

    def note(stamp):
        cycle(stamp)
        sent.append(np.concatenate([values for pipe in plugin.outputs.commanding for _, values in pipe.fields]))

    plugin.outputs.send = note
    world.run(0.5)
    starts = hands(plugin)
    for task, way in WAYS.items():
        world.ask("manipulation/reference", task=task, values=way, relative=True)
    world.run(1.5)
    assert plugin.life == PluginState.RUNNING
    return np.array(sent), {task: place - starts[task] for task, place in hands(plugin).items()}


def hands(plugin):
    """Return where the measured hands are, relative to the pelvis."""
    kinematics = plugin.robot.kinematics
    kinematics.update(plugin.robot.state.position)
    links = {"left": "arm1_7", "right": "arm2_7"}
    return {task: kinematics.position(link) - kinematics.position("pelvis") for task, link in links.items()}


def test_hands_move_alike_in_both_memories(tmp_path):
    """The same commands to the last digits in memory and in shared memory."""
    runs = []
    for world in (World(), XbotWorld(tmp_path)):
        with contextlib.closing(world):
            sent, ways = commands(world)
        runs.append(sent)
        for task, way in WAYS.items():
            np.testing.assert_allclose(ways[task], way, atol=0.02)
    count = min(map(len, runs))
    assert count > 300 and np.abs(runs[0][:count] - runs[1][:count]).max() < 1e-9
    assert np.ptp(runs[0], axis=0).max() > 0.2

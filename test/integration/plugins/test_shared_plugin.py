"""The shared plugin with stand-ins for Fig. 5: order, updates, what stays equal, and what fails alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.shared.figure_5 import ORDER, Figure5World, write

from solfer.plugins import CycleTrace, PluginState
from solfer.transport.plugin_state import FAILED_STATES

NEEDS = {
    "estimation": (),
    "forces": ("estimation",),
    "locomotion": ("estimation", "forces"),
    "compensation": ("estimation", "forces", "locomotion"),
}
"""What a component cannot go on without."""


@pytest.fixture
def shared(tmp_path):
    """Make the shared plugin, with other tags of some modules; it runs."""
    worlds = []

    def make(**modules):
        world = Figure5World(write(tmp_path, **modules))
        worlds.append(world)
        world.run(0.5)
        return world

    yield make
    for world in worlds:
        world.close()


def test_a_cycle_of_figure_5(shared):
    """The whole order of reads, computations and messages in a cycle, each with the message that made it necessary."""
    world = shared()
    trace = CycleTrace([world.plugins[name] for name in ORDER])
    world.run(0.02)
    trace.close()
    assert trace.of(2) == [
        "estimation reads link_side_online",
        "estimation reads imu_base",
        "estimation computes kinematics because of link_side_online, imu_base",
        "estimation writes",
        "estimation publishes estimated",
        "forces reads link_side_online",
        "forces reads odometry",
        "forces computes kinematics because of link_side_online, odometry",
        "forces computes bias because of link_side_online, odometry",
        "forces computes contacts because of link_side_online, odometry",
        "forces publishes ground",
        "locomotion computes kinematics because of estimation",
        "locomotion computes contacts because of link_side_online, imu_base, estimation",
        "locomotion reads ground",
        "locomotion publishes lower_body",
        "compensation reads ground",
        "compensation reads lower_body",
        "compensation reads upper_body",
        "compensation publishes position_controller",
        "compensation publishes velocity_controller",
    ]


def test_separate_plugins_command_the_same(tmp_path):
    """Sharing one robot saves computations and changes no command, compared to plugins of their own over topics."""
    file, commands, counts = write(tmp_path), [], []
    for shared in (True, False):
        world = Figure5World(file, shared)
        world.move()
        assert {plugin.life for plugin in world.plugins.values()} == {PluginState.RUNNING}
        robots = {id(plugin.robot.kinematics): plugin.robot for plugin in world.plugins.values()}
        found = [robot.computations() for robot in robots.values()]
        counts.append([sum(each.get(name, 0) for each in found) for name in ("kinematics", "bias")])
        commands.append(np.array(world.commands))
        whole, turned = world.plugins["compensation"].robot, np.ptp(world.turned, axis=0)
        sent = {name for pipe in world.plugins["compensation"].outputs.commanding for name in pipe.message.names}
        world.close()
    assert_allclose(commands[0], commands[1], rtol=0, atol=1e-9)
    moved = dict(zip(whole.dofs, np.ptp(commands[0][60:, : whole.size], axis=0), strict=True))
    assert {name for name in sent if moved[name] < 0.2} == {f"j_wheel_{number}" for number in (1, 2, 3, 4)}
    assert (turned > 0.2).all()
    cycles = len(commands[0])
    assert abs(counts[0][0] - 3 * cycles) <= 8 and abs(counts[0][1] - cycles) <= 4
    assert abs(counts[1][0] - 4 * cycles) <= 12 and abs(counts[1][1] - 2 * cycles) <= 6


@pytest.mark.daily(1)
@pytest.mark.parametrize("name", ORDER)
@pytest.mark.parametrize("fault", ["update", "send", "nan", "slow"])
def test_one_component_fails_alone(shared, name, fault):
    """Components that need nothing of the failed one miss no cycle, and the failed one can be switched on again."""
    world = shared()
    world.run(0.5)
    others = [other for other in ORDER if other != name]
    untouched = [other for other in others if name not in NEEDS[other]]
    before = {other: world.plugins[other].component.cycles for other in others}
    world.plugins[name].component.fault = fault
    world.run(1.0)
    assert world.parts[name].state is PluginState.ABORTED
    assert {other: world.plugins[other].component.cycles - before[other] for other in untouched} == dict.fromkeys(
        untouched, 200
    )
    assert not any(world.parts[other].state in FAILED_STATES for other in others)
    assert all(np.isfinite(plugin.robot.state.position).all() for plugin in world.plugins.values())
    world.plugins[name].component.fault = ""
    assert world.ask(f"{name}/switch", data=True).success
    world.run(1.5)
    assert {managed.state for managed in world.parts.values()} == {PluginState.RUNNING}

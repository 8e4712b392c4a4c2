"""Components in libraries as plugins: they command what their twins in Python do, and processes that end with them."""

import signal
from contextlib import closing

import numpy as np
import pytest
from support.integration.world import World
from support.integration.xbot_system import HELD, REPOSITORY, system, until
from support.integration.xbot_world import XbotWorld
from support.native import JointSpaceTwin, build
from support.plugins.plugin import configuration

from solfer.plugins import PluginState

pytestmark = pytest.mark.slow

TWIN = f"{JointSpaceTwin.__module__}:{JointSpaceTwin.__name__}"
CARRIED = {"dynamics": True, "kinematics": True, "joints": "arms"}


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return build(tmp_path_factory.mktemp("native") / "libcomponents.so")


def commands(world, folder, target):
    """Run the component for a second; return the torques that it has commanded in each period."""
    plugin = world.plugin("test", configuration(folder, **{"class": target}, **CARRIED), target)
    sent = []
    for _ in range(100):
        world.run(0.01)
        sent.append(plugin.robot.command.torque.copy())
    assert plugin.life is PluginState.RUNNING
    return np.array(sent)


@pytest.mark.parametrize("made", (lambda _: World(), XbotWorld), ids=("memory", "shared memory"))
def test_it_commands_what_its_twin_commands(library, tmp_path, made):
    found = {}
    for name, target in (("native", f"{library}::JointSpace"), ("twin", TWIN)):
        folder = tmp_path / name
        folder.mkdir()
        with closing(made(folder)) as world:
            found[name] = commands(world, folder, target)
    native, twin = found["native"], found["twin"]
    assert np.abs(native - twin).max() < 1e-12 < np.ptp(native, axis=0).max()


@pytest.mark.parametrize("how", ("segfault", "hang"))
def test_a_process_that_it_ends_leaves_the_robot_held(library, tmp_path, how):
    """A library that breaks off ends the process of its layer as `kill -9` does; one that hangs is ended by it."""
    tags = {"class": f"{library}::Failing", "how": how, "after": 400}
    file = tmp_path / "layer.yaml"
    file.write_text(f"""
XBotRTPlugins: {{plugins: [test]}}
mwoibn: {{config_file: {configuration(tmp_path, **tags)}}}
executor: {{rate: 200, start: [test], blend: 0.2}}
""")
    with system() as layer:
        layer.simulate()
        process = layer.start(REPOSITORY / "nodes" / "xbot", str(file), "--namespace", layer.name)
        until(lambda: layer.state() is PluginState.RUNNING, "the plugin")
        if how == "hang":
            layer.watchdog()
        assert process.wait(60.0) == -(signal.SIGKILL if how == "hang" else signal.SIGSEGV)
        layer.look()
        before = layer.samples[-1][1]
        layer.watch(0.5)
        assert np.abs(layer.samples[-1][1] - before).max() < HELD and abs(layer.speed()) < 0.05

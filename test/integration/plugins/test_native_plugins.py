"""Components in libraries as plugins: they command what their twins in Python do, and processes that end with them."""

import signal
from contextlib import closing

import numpy as np
import pytest
import yaml
from support.integration.world import World
from support.integration.xbot_system import HELD, REPOSITORY, system, until
from support.integration.xbot_world import XbotWorld
from support.native import LISTINGS, JointSpaceTwin, TaskTrackingTwin, build
from support.plugins.plugin import configuration

from solfer.config import load_shared
from solfer.plugins import PluginState, Registry

pytestmark = pytest.mark.slow

COMPUTES = {"dynamics": True, "kinematics": True}
CARRIED = COMPUTES | {"joints": "arms"}
TRACKED = COMPUTES | {
    "way": [0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0, 0.0, 0.02],
    "hands": "manipulation",
    "torso": "torso_2",
}


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return build(tmp_path_factory.mktemp("native") / "libcomponents.so")


@pytest.fixture(scope="module")
def listings(tmp_path_factory):
    return build(tmp_path_factory.mktemp("native") / "liblistings.so", source=LISTINGS)


def commands(world, folder, target, tags):
    """Run the component for a second; return positions and torques that it has commanded in each period."""
    plugin = world.plugin("test", configuration(folder, **{"class": target}, **tags), target)
    sent = []
    for _ in range(100):
        world.run(0.01)
        sent.append((plugin.robot.command.position.copy(), plugin.robot.command.torque.copy()))
    assert plugin.life is PluginState.RUNNING
    return np.array(sent)


@pytest.mark.parametrize("made", (lambda _: World(), XbotWorld), ids=("memory", "shared memory"))
@pytest.mark.parametrize(
    ("file", "name", "twin", "tags"),
    (
        ("library", "JointSpace", JointSpaceTwin, CARRIED),
        ("listings", "TaskTracking", TaskTrackingTwin, TRACKED),
    ),
)
def test_it_commands_what_its_twin_commands(request, tmp_path, file, name, twin, tags, made):
    native = f"{request.getfixturevalue(file)}::{name}"
    found = {}
    for name, target in (("native", native), ("twin", f"{twin.__module__}:{twin.__name__}")):
        folder = tmp_path / name
        folder.mkdir()
        with closing(made(folder)) as world:
            found[name] = commands(world, folder, target, tags)
    assert np.abs(found["native"] - found["twin"]).max() < 1e-12
    assert np.ptp(found["native"], axis=0).max() > 0.01


def test_two_of_one_library_share_a_plugin(library, tmp_path):
    file = configuration(tmp_path, **{"class": f"{library}::JointSpace"}, **CARRIED)
    tree = yaml.safe_load(file.read_text())
    modules = tree["mwoibn"]["modules"]
    modules["other"] = modules["test"] | {"class": f"{library}::Empty", "mode": "idle"}
    del modules["other"]["joints"]
    modules["both"] = {"layer": "NRT", "plugins": ["other", "test"]}
    file.write_text(yaml.safe_dump(tree))
    with closing(World()) as world:
        shared = load_shared(file, "both", default=Registry().configuration, system="SM")
        together = world.together(shared.plugins)
        together.start()
        world.bus.every(1.0 / together.rate, together.cycle, cycles=True)
        world.run(0.5)
        assert [each.plugin.life for each in together.plugins] == [PluginState.RUNNING] * 2
        assert together.plugins[0].plugin.robot.shares_measurement(together.plugins[1].plugin.robot)


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

"""The check of a shared plugin finds what its start refuses, with the same places; also in a real-time layer."""

import copy
import re
from dataclasses import dataclass, field

import pytest
import yaml
from support.plugins.fleet import JOINTS, MOVING, SRDF, tree
from support.unit.cart import URDF

from solfer.components import Component, TopicOut
from solfer.config import load_shared
from solfer.errors import ClaimRefused, SolferError, singles
from solfer.interfaces.geometry import Header, Vector
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Registry, check_file, generate_shared
from solfer.plugins.generation.check import check_layer
from solfer.plugins.generation.dry_run import DryMiddleware
from solfer.robot.description.shipped import robot_files


@dataclass(frozen=True)
class Force:
    """geometry_msgs/Vector3Stamped."""

    header: Header = field(default_factory=Header)
    vector: Vector = field(default_factory=Vector)


class ForcePublisher(Component):
    """Declares topics of its own."""

    def topics(self):
        """Publish one below its name."""
        return (TopicOut("force", "geometry_msgs/Vector3Stamped", Force, Force),)


class Shouting(Component):
    """Declares a topic with a whole name."""

    def topics(self):
        """Publish it."""
        return (TopicOut("/force", "geometry_msgs/Vector3Stamped", Force, Force),)


def shared_tree(folder, *plugins, **changes):
    """Return a configuration with files, a pipe between plugins, and a shared plugin; `changes` are tags of modules."""
    changed = tree()
    for name, text in (("cart.urdf", URDF), ("cart.srdf", SRDF)):
        (folder / name).write_text(text)
    changed["ros"]["source"] = {"urdf": {"file": "cart.urdf"}, "srdf": {"file": "cart.srdf"}}
    changed["feedback"]["desired"] = {
        "space": "JOINT", "dofs": JOINTS, "interface": {"position": True}, "function": "reference"
    }  # fmt: skip
    changed["ros"]["feedback"]["desired"] = {"source": "left", "message": "solfer/JointCommand"}
    changed["robot"]["following"] = changed["robot"]["jointed"] | {"feedback": {"list": ["joints", "desired"]}}
    for name, tags in changes.items():
        changed["modules"][name] |= tags
    listed = [f"any::{name}" for name in plugins or ("first", "second")]
    changed["modules"]["shared"] = {"layer": "NRT", "plugins": listed}
    return changed


def written(folder, changed):
    """Write a configuration, and return its file."""
    file = folder / "main.yaml"
    file.write_text(yaml.safe_dump({"mwoibn": changed}))
    return file


def start(file):
    """Make the plugins of the shared plugin."""
    bus = Bus()
    return generate_shared(
        load_shared(file).plugins, lambda each: MemoryMiddleware(bus, each.module.name), Registry()
    ).plugins


def refusals(file, modules=None):
    """Return the errors of the start and those of the check, as texts."""
    with pytest.raises(SolferError) as refused:
        start(file)
    return [str(error) for error in singles([refused.value])], [str(each) for each in check_file(file, modules).errors]


def two_publishers(changed):
    changed["modules"]["first"]["controller"], changed["modules"]["second"]["controller"] = ["left"], ["right"]
    changed["ros"]["controller"]["right"]["sink"] = "/left"


def two_declared(changed):
    changed["modules"]["first"]["class"] = f"{__name__}:Shouting"
    changed["modules"]["second"]["controller"] = ["left"]
    changed["ros"]["controller"]["left"]["sink"] = "force"


def another_interface(changed):
    changed["modules"]["first"]["controller"] = ["left"]
    changed["modules"]["second"]["robot"] = "following"
    changed["feedback"]["desired"]["interface"] = MOVING


def another_map(changed):
    changed["modules"]["first"]["controller"] = ["left"]
    changed["modules"]["second"]["robot"] = "following"
    changed["controller"]["left"]["dofs"] = JOINTS | {"chain": "wheels"}


def another_order(changed):
    changed["modules"]["first"]["robot"] = "following"  # it receives what a later one publishes
    changed["modules"]["second"]["controller"] = ["left"]
    changed["controller"]["left"]["dofs"] = JOINTS | {"chain": "wheels"}


def two_sources(changed):
    changed["modules"]["second"]["robot"] = "encoded"


def a_strange_required(changed):
    changed["modules"]["second"]["requires"] = ["frist"]


def requires_itself(changed):
    changed["modules"]["second"]["requires"] = ["second"]


def a_strange_configuration(changed):
    changed["modules"]["shared"]["plugins"] = ["any::frist"]


def an_empty_name(changed):
    changed["modules"]["shared"]["plugins"] = ["any::"]


def two_rates(changed):
    changed["modules"]["second"]["secondary_file"] = {"file": "slow.yaml"}


def unknown_class(changed):
    changed["modules"]["second"]["class"] = "support.plugins.fleet:Readr"


LEFT, RIGHT = "mwoibn.ros.controller.left.sink", "mwoibn.ros.controller.right.sink"
DESIRED, ENTRY = "mwoibn.ros.feedback.desired.source", "mwoibn.modules.shared.plugins[0]: "
SECOND = "mwoibn.modules.second."
MISTAKES = {
    two_publishers: (f"{RIGHT}: ", LEFT, "both publish the topic 'left'"),
    two_declared: ("mwoibn.modules.first: ", LEFT, "both publish the topic 'force'"),
    another_interface: (f"{DESIRED}: ", LEFT, "'velocity' is not sent, only position"),
    another_map: (f"{DESIRED}: ", LEFT, "does not fit what 'first' sends (left"),
    another_order: (f"{DESIRED}: ", LEFT, "does not fit what 'second' sends (left"),
    two_sources: ("encoders.source: ", "joints.source", "the measured position of 'shoulder' has two sources"),
    a_strange_required: (f"{SECOND}requires[0]: ", "did you mean: first"),
    requires_itself: (f"{SECOND}requires[0]: ", "'second' requires itself"),
    a_strange_configuration: (ENTRY, "did you mean: first"),
    an_empty_name: (ENTRY, "'any::' names no plugin"),
    two_rates: ("slow.yaml:1:", "main.yaml:", "'second' has 50 Hz, and 'first' 200 Hz"),
    unknown_class: (f"{SECOND}class: ", "did you mean: Reader"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return the working directory."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slow.yaml").write_text("mwoibn: {robot: {rate: 50.0}}")
    return tmp_path


@pytest.mark.parametrize("modules", [None, ["shared"]], ids=["file", "shared"])
@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.__name__)
def test_check_finds_what_the_start_refuses(folder, mistake, modules):
    changed = shared_tree(folder)
    mistake(changed)
    started, checked = refusals(written(folder, changed), modules)
    assert started == checked and len(checked) == 1
    assert re.match(r"\S*\.yaml:\d+:\d+: ", checked[0]) and all(words in checked[0] for words in MISTAKES[mistake])


def test_what_has_no_mistake_passes(folder):
    tags = {"controller": ["left"]}, {"robot": "following", "requires": ["first"]}
    file = written(folder, shared_tree(folder, first=tags[0], second=tags[1]))
    assert [plugin.name for plugin in start(file)] == ["first", "second"]
    assert check_file(file).errors == check_file(file, ["shared"]).errors == ()


def in_layer(folder, changed, plugins="[shared]"):
    """Write a real-time layer of a configuration, and return its file."""
    changed = changed | {"xbot": copy.deepcopy(changed["ros"]), "layers": {"RT": {"file": "rate.yaml"}}}
    (folder / "rate.yaml").write_text("mwoibn: {}")
    written(folder, changed)
    file = folder / "rt.yaml"
    file.write_text(f"XBotRTPlugins: {{plugins: {plugins}}}\nmwoibn: {{config_file: main.yaml}}\n")
    return file


@pytest.mark.parametrize("mistake", [two_publishers, another_interface, another_map, two_sources, unknown_class])
def test_check_of_a_layer_finds_it(folder, mistake):
    changed = shared_tree(folder)
    mistake(changed)
    errors = [str(error) for error in check_layer(in_layer(folder, changed)).errors]
    assert len(errors) == 1 and all(words.replace(".ros.", ".xbot.") in errors[0] for words in MISTAKES[mistake])


@pytest.mark.parametrize("starting", ["[shared]", "[odometry]"])
def test_two_that_start_together_command_one_joint(tmp_path, repository, starting):
    """The start refuses them with the place of the later one in the list; the check finds it, in a layer as well."""
    config = repository / "config"
    for name in ("support", "robots"):
        (tmp_path / name).symlink_to(config / name)
    file, layer = tmp_path / "main.yaml", tmp_path / "layer.yaml"
    own = "      shared: {robot: driven, controller: [lower_body]}"
    text = (config / "centauro.yaml").read_text()
    assert own in text
    file.write_text(text.replace(own, "      #"))
    layer.write_text(
        "XBotRTPlugins: {plugins: [shared]}\nmwoibn: {config_file: {file: main.yaml}}\n"
        f"executor: {{start: {starting}}}\n"
    )
    registry = Registry()
    shared = load_shared(file, default=registry.configuration)
    with pytest.raises(ClaimRefused) as refused:
        generate_shared(shared.plugins, lambda each: DryMiddleware(each, robot_files(each)), registry)
    assert "'gravity_compensation' and 'wheeled_motion' both command the effort" in refused.value.what
    assert refused.value.where == str(shared.record.place("plugins", 4))
    assert [str(error) for error in check_file(file, ["shared"]).errors] == [str(refused.value)]
    found = [error.what for error in check_layer(layer).errors]
    assert found == ([refused.value.what] if starting == "[shared]" else [])


def test_several_mistakes_are_found_at_once(folder):
    changed = shared_tree(folder, "first", "second", "third", third={"controller": ["left"]})
    for mistake in (two_publishers, two_sources):
        mistake(changed)
    changed["modules"]["first"]["kinematics"] = "perhaps"
    assert len(check_file(written(folder, changed)).errors) == 1  # the shared plugin cannot be read
    changed["modules"]["first"]["kinematics"] = True
    started, checked = refusals(written(folder, changed))
    assert set(started) < set(checked) and len(started) == 2 and len(checked) == 3


def test_the_same_configuration_twice_starts(folder):
    changed = shared_tree(folder, "first", "first", "second", first={"controller": ["left"]})
    changed["modules"]["second"]["robot"] = "following"
    file = written(folder, changed)
    first, again, second = start(file)
    assert [plugin.outputs.controllers[0][0].writer.topic for plugin in (first, again)] == ["left", "left_2"]
    assert second.feedbacks[1].reader.channel.publication.component == "first"
    assert check_file(file).errors == check_layer(in_layer(folder, changed)).errors == ()
    changed["ros"]["feedback"]["desired"]["source"] = "left_2"
    (*_, second) = start(written(folder, changed))
    assert second.feedbacks[1].reader.channel.publication.component == "first_2"
    assert not check_file(file).warnings


def test_topics_with_a_slash_keep_their_names(folder):
    changed = shared_tree(folder, "first", "first", first={"controller": ["left"]})
    changed["ros"]["controller"]["left"]["sink"] = "/left"
    started, checked = refusals(written(folder, changed))
    assert started == checked and "'first' (" in checked[0] and "and 'first_2' both publish" in checked[0]


def test_declared_topics_follow_the_name(folder):
    changed = shared_tree(folder, "first", "first", first={"class": f"{__name__}:ForcePublisher"})
    file = written(folder, changed)
    assert check_file(file).errors == ()
    loaded, bus = load_shared(file), Bus()
    members = generate_shared(loaded.plugins, lambda each: MemoryMiddleware(bus, each.module.name), Registry())
    assert [topic for topic, _ in members.spaces["shared"].channels] == ["first/force", "first_2/force"]

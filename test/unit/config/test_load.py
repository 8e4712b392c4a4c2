"""One module of a main configuration: files laid over each other, sets and pipes resolved."""

import pytest
from pydantic import Field

from solfer.config import Record, load, load_shared, module_names
from solfer.errors import UnknownName


@pytest.fixture
def folder(repository, monkeypatch):
    """Change the working directory, so that places have short names."""
    monkeypatch.chdir(repository / "test/data/config")


pytestmark = pytest.mark.usefixtures("folder")


class MoverRecord(Record):
    """Tags of a component."""

    speed: float = Field(description="speed [rad/s]")
    depth: int = Field(description="number of the file that won")
    from_system: int = Field(description="1")
    from_layer: int = Field(description="2")
    from_secondary: int = Field(description="3")


def test_the_modules_of_a_file_are_listed():
    assert module_names("main.yaml") == load("main.yaml", "mover").modules == ("mover", "player")


def test_later_files_win_and_values_keep_places():
    configuration = load("main.yaml", "mover")
    tags = configuration.tags(MoverRecord)
    assert tags == MoverRecord(speed=1.0, depth=3, from_system=1, from_layer=2, from_secondary=3)
    assert configuration.rate == 200.0
    assert tags.where("speed") == "system.yaml:4:20: mwoibn.modules.mover.speed"
    assert tags.where("from_layer") == "layer.yaml:4:25: mwoibn.modules.mover.from_layer"
    assert tags.where("depth") == "secondary.yaml:3:39: mwoibn.modules.mover.depth"
    assert configuration.where("robot", "rate") == "layer.yaml:2:17: mwoibn.robot.rate"
    assert configuration.where("robot", "name") == "main.yaml:7:11: mwoibn.robot.name"


def test_module_keys_are_read_after_merging():
    assert load("main.yaml", "mover").module.mode == "idle"
    module = load("main.yaml", "player").module
    assert (module.name, module.layer, module.robot) == ("player", "NRT", "offline")
    assert (module.kinematics, module.dynamics, module.model_change) == (True, True, True)
    assert module.class_ == "my_package.player:Player"
    assert load("main.yaml", "player", class_name="a.b:C").module.class_ == "a.b:C"


def test_a_secondary_file_reaches_its_own_module_only():
    assert [pipe.name for pipe in load("main.yaml", "mover").feedbacks] == ["joints"]
    assert load("main.yaml", "player").where("feedbacks", "measured") == "main.yaml:19:15: mwoibn.feedbacks.measured"


def test_pipes_are_merged_with_the_middlewares_part():
    configuration = load("main.yaml", "mover")
    (feedback,) = configuration.feedbacks
    assert (feedback.dofs.chain, feedback.dofs.mapping, feedback.function) == ("all", "FEEDBACK", "state")
    assert (feedback.interface.position, feedback.interface.velocity, feedback.interface.effort) == (True, True, False)
    assert (feedback.source, feedback.message, feedback.initialize) == (
        "joint_states", "sensor_msgs::JointState", True,
    )  # fmt: skip
    assert configuration.where(feedback, "dofs", "chain") == "main.yaml:25:21: mwoibn.feedback.joints.dofs.chain"
    assert feedback.dofs.where("chain") == configuration.where(feedback, "dofs", "chain")
    assert configuration.where(feedback, "source") == "main.yaml:50:24: mwoibn.ros.feedback.joints.source"
    assert configuration.where(feedback) == "main.yaml:23:5: mwoibn.feedback.joints"


def test_controllers_come_from_a_set_or_a_list():
    position, broadcast = load("main.yaml", "mover").controllers
    assert (position.name, position.type, position.sink, position.lower_level) == (
        "position", "impedance", "/command", True,
    )  # fmt: skip
    assert (broadcast.name, broadcast.type, broadcast.sink, broadcast.lower_level) == (
        "broadcast", "reference", "desired_state", False,
    )  # fmt: skip
    assert load("main.yaml", "player").controllers == (broadcast,)


def test_robot_sources_and_maps():
    configuration = load("main.yaml", "mover")
    robot, sources = configuration.robot, configuration.sources
    assert (robot.name, robot.configuration, robot.actuators.read, robot.contacts.read) == (
        "robi", "online", True, False,
    )  # fmt: skip
    assert (sources.urdf.parameter, sources.urdf.location) == ("/robot", None)
    assert (sources.srdf.parameter, str(sources.srdf.location)) == (None, "robi.srdf")
    assert sources.contacts is None
    assert configuration.mappings["PYTHON"].source == "joint_states"
    assert configuration.mappings["LEGS"].urdf.parameter == "/legs"
    assert (configuration.middleware, configuration.system) == ("ROS", "SM")


def test_an_unknown_module_names_the_nearest():
    with pytest.raises(UnknownName) as caught:
        load("main.yaml", "moover")
    assert caught.value.where == "main.yaml:55:3: mwoibn.modules"
    assert caught.value.names[0] == "mover"


def test_an_unknown_tag_names_tags_and_common_keys():
    class Nothing(Record):
        spede: float = Field(default=0.0, description="-")
        depth: float = Field(default=0.0, description="-")

    with pytest.raises(Exception, match="unknown key 'speed'") as caught:
        load("main.yaml", "mover").tags(Nothing)
    errors = {error.name: error for error in caught.value.errors}
    assert set(errors) == {"speed", "from_system", "from_layer", "from_secondary"}
    assert errors["speed"].names[0] == "spede"


def test_unwritten_places_fall_back_to_the_nearest():
    configuration = load("main.yaml", "mover")
    assert configuration.where("ros", "feedback", "joints", "filter", "run").startswith("main.yaml:50:")
    assert configuration.where() == "main.yaml:1:1: mwoibn"


@pytest.mark.parametrize(("mode", "modes"), [("idle", ["idle", "idle"]), ("full", ["full", "idle"])])
def test_a_shared_plugin_makes_others_idle_but_never_full(repository, tmp_path, mode, modes):
    plugins = "plugins: ['Mover::mover', 'my_package.player:Player::player']"
    for path in (repository / "test/data/config").iterdir():
        (tmp_path / path.name).symlink_to(path)
    text = (tmp_path / "main.yaml").read_text().replace("secondary_file:", "unused:")
    (tmp_path / "shared.yaml").write_text(f"{text}    shared: {{layer: NRT, mode: {mode}, {plugins}}}\n")
    assert [one.module.mode for one in load_shared(tmp_path / "shared.yaml").configurations] == modes

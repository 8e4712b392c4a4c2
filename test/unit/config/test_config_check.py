"""Checking a whole main configuration: everything in it, all mistakes at once, warnings beside them."""

import shutil
import sys
from pathlib import Path

import pytest
from support.modules import forget

from solfer.config import check, load
from solfer.plugins import check_file
from solfer.plugins.generation.sources import sinks_of


@pytest.fixture
def folder(repository, tmp_path, monkeypatch):
    """Copy the shipped configuration, and make it the working directory."""
    shutil.copytree(repository / "config", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def replace(file: str, *changes: tuple[str, str]) -> None:
    text = Path(file).read_text()
    for right, wrong in changes:
        assert right in text, right
        text = text.replace(right, wrong, 1)
    Path(file).write_text(text)


def line_of(file: str, part: str) -> int:
    return 1 + next(number for number, line in enumerate(Path(file).read_text().splitlines()) if part in line)


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_ten_mistakes_are_reported_in_one_run():
    """Ten kinds of mistakes in two files: each is reported at its line, and no follow-up errors appear."""
    changes = {
        "centauro.yaml": [
            ("system: SM ", "system: MS "),
            ("layer: measured ", "layer: mesured "),
            ("chain: all         # an SRDF group", "chain: al         # an SRDF group"),
            ("velocity: true\n        effort: true", "velocity: yes\n        effort: true"),
            ("chain: wheels\n", "chain: weels\n"),
            ("loading: model, urdf: /robot_upper", "loading: modle, urdf: /robot_upper"),
            ("sink: /command   ", "snik: /command   "),
            ("mode: full ", "mode: ful "),
            ("speed: 0.5 ", "speed: fast "),
        ],
        "support/lower_body.yaml": [("    source:", "    sauce:")],
    }
    for file, mistakes in changes.items():
        replace(file, *mistakes)
    report = check_file("centauro.yaml")
    found = [tuple(error.where.split(":")[:2]) for error in report.errors]
    wrong = [
        ("centauro.yaml", str(line_of("centauro.yaml", part)))
        for part in (
            "MS",
            "mesured",
            "chain: al ",
            "velocity: yes",
            "chain: weels",
            "modle",
            "snik",
            "mode: ful ",
            "fast",
        )
    ]
    wrong.append(("support/lower_body.yaml", str(line_of("support/lower_body.yaml", "sauce"))))
    assert len(wrong) == 10 and set(wrong) <= set(found)
    assert not set(found) - set(wrong), [str(error) for error in report.errors]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("right", "wrong", "words"),
    [
        ("  xbot: *ends", "  xbot: {feedback: {link_side_online: {layr: online}}}", "unknown key 'layr'"),
        ("  feedbacks:\n", "  feedbacks:\n    spare: [link_side_ofline]\n", "unknown feedback pipe 'link_side_ofline'"),
        ("    direct:\n", "    spare: {lst: []}\n    direct:\n", "unknown key 'lst'"),
        ("  feedback:\n    link", "  feedback:\n    spare: {space: JOIN}\n    link", "expected 'JOINT', 'OPERATIONAL'"),
        ("    joint_space:\n", "    spare: {feedback: {layer: x}}\n    joint_space:\n", "'actuators' is missing"),
        ("    mapping:    ", "    mapping:\n      SPARE: {loading: topic}\n#", "needs the key 'source'"),
    ],
)
def test_what_no_module_uses_is_checked(right, wrong, words):
    replace("centauro.yaml", (right, wrong))
    assert any(words in str(error) for error in check("centauro.yaml").errors)


@pytest.mark.usefixtures("folder")
def test_the_file_of_another_system_is_checked():
    replace("support/hardware.yaml", ("torso_yaw:     {name: J01, sign: -1", "torso_yaw:     {name: J01, sign: 0"))
    (error,) = check("centauro.yaml").errors
    assert error.where.startswith("support/hardware.yaml:8:")


@pytest.mark.usefixtures("folder")
def test_unused_parts_may_be_incomplete_with_a_warning():
    replace("centauro.yaml", ("  feedback:\n    link", "  feedback:\n    spare: {space: JOINT}\n    link"))
    report = check("centauro.yaml")
    assert report.errors == ()
    assert {notice.what for notice in report.warnings if notice.mark.path[-1] == "spare"} == {
        f"the key '{key}' is missing, so nothing can use it" for key in ("dofs", "interface")
    }


@pytest.mark.usefixtures("folder")
def test_a_module_only_in_a_layer_warns():
    Path("support/NRT.yaml").write_text("mwoibn:\n  robot: {rate: 200}\n  modules: {joint_state: {speed: 1}}\n")
    (notice,) = check("centauro.yaml").warnings
    assert "no module 'joint_state'" in notice.what and "did you mean joint_states" in notice.what
    assert (notice.mark.file, notice.mark.line) == ("support/NRT.yaml", 3)


@pytest.mark.usefixtures("folder")
def test_single_modules_can_be_checked():
    replace("centauro.yaml", ("false\n      chain: lower_body", "false\n      chain: lower_boby"))
    assert check_file("centauro.yaml", ["joint_states"]).errors == ()
    (error,) = check_file("centauro.yaml", ["joint_lower"]).errors
    assert error.names[0] == "lower_body"
    (unknown,) = check_file("centauro.yaml", ["joint_lover"]).errors
    assert unknown.names[0] == "joint_lower"


POINT = """
    hand:
      space: POINT
      quantity: position
      interface: fixed
      link: %s
      source: hand
      message: geometry_msgs/PointStamped
    link_side_online: """


@pytest.mark.usefixtures("folder")
def test_the_link_of_a_point_has_to_exist():
    replace(
        "centauro.yaml",
        ("measured: [link_side_online]", "measured: [link_side_online, hand]"),
        ("\n    link_side_online: ", POINT % "arm1_7"),
    )
    (error,) = check_file("centauro.yaml", ["joint_states"]).errors
    assert error.kind == "input of the component"  # `joint_states` has none
    replace("centauro.yaml", ("link: arm1_7", "link: arm1_77"))
    (error,) = check_file("centauro.yaml", ["joint_states"]).errors
    assert (error.kind, error.names[0]) == ("link", "arm1_7")


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_a_base_read_before_its_joints_warns():
    change = ("list: [link_side_online, imu_base]", "list: [imu_base, link_side_online]")
    replace("centauro.yaml", change, change)
    before = len(check_file("centauro.yaml", ["odometry"]).warnings)
    replace("centauro.yaml", ("name: imu_link ", "name: arm1_7 "))
    warnings = check_file("centauro.yaml", ["odometry"]).warnings
    [published] = [
        str(warning) for warning in warnings if "'imu_base' is read before 'link_side_online'" in str(warning)
    ]
    assert len(warnings) == before + 1  # joints do not move the IMU against the base
    assert published.startswith(f"centauro.yaml:{line_of('centauro.yaml', 'imu_base:  ')}:")


@pytest.mark.usefixtures("folder")
def test_two_feedbacks_for_one_base_value_are_refused():
    """Two sources would overwrite each other in turn, so the error gives the places of both, value by value."""

    def place(pipe, interface):
        """Find the line of the library where a pipe carries an interface."""
        lines = Path("centauro.yaml").read_text().splitlines()
        return next(
            number
            for number, line in enumerate(lines, 1)
            if number > line_of("centauro.yaml", pipe) and f" {interface}: true" in line
        )

    replace("centauro.yaml", ("measured: [link_side_online]", "measured: [link_side_online, imu_base, floating_base]"))
    errors = check_file("centauro.yaml", ["joint_states"]).errors
    for error, interface in zip(errors, ("position", "velocity"), strict=True):
        assert str(error).startswith(f"centauro.yaml:{place('&floating_base', interface)}:")
        assert f"'imu_base' (centauro.yaml:{place('    imu_base:  ', interface)}:" in str(error)
        assert f"and 'floating_base' both set the '{interface}' of the floating base" in str(error)
    line = place("    imu_base:  ", "position")
    lines = Path("centauro.yaml").read_text().splitlines(keepends=True)
    lines[line - 1] = lines[line - 1].replace("true", "false")
    Path("centauro.yaml").write_text("".join(lines))
    (error,) = check_file("centauro.yaml", ["joint_states"]).errors
    assert "'velocity'" in str(error)


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_a_class_that_is_not_there():
    replace("centauro.yaml", ("class: solfer.components.joint_states:JointStates", "class: elsewhere.mover:Mover"))
    (error,) = check_file("centauro.yaml", ["joint_online"]).errors
    assert "No module named 'elsewhere'" in error.what and error.where.startswith("centauro.yaml:")
    replace("centauro.yaml", ("class: elsewhere.mover:Mover", "class: solfer.components.joint_states:JointState"))
    (error,) = check_file("centauro.yaml", ["joint_online"]).errors
    assert error.names[0] == "JointStates" and error.where.startswith("centauro.yaml:")


@pytest.mark.usefixtures("folder")
def test_tags_without_a_record_give_warnings():
    named = "class: solfer.components:Component"
    replace("centauro.yaml", (named, f"speed: 1\n      {named}"))
    report = check_file("centauro.yaml", ["whole_body"])
    (notice,) = report.warnings
    assert report.errors == () and str(notice).endswith("speed: has no effect: the component has no tags of its own")


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_a_robot_without_files_is_a_warning():
    replace(
        "centauro.yaml",
        ("name: centauro  #", "name: unseen  #"),
        ("contacts: {file: robots/centauro/contacts.yaml}", "contacts: /robot_contacts"),
        ("actuators: {file: robots/centauro/actuators.yaml}", "actuators: /robot_actuators"),
    )
    report = check_file("centauro.yaml", ["joint_states"])
    assert report.errors == ()
    assert any("the robot has no files here" in notice.what for notice in report.warnings)


@pytest.mark.daily(2)
@pytest.mark.slow
@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("wrong", "what", "meant"),
    [
        ("name: centaur  #", "unknown robot 'centaur'", ("centauro",)),
        ("nmae: centauro  #", "unknown key of 'robot' 'nmae'", ("name", "rate")),
        ("# name: ", "the robot has no name", ()),
    ],
)
@pytest.mark.parametrize("modules", [None, ["joint_states"]])
def test_a_misspelt_robot_is_reported_once(wrong, what, meant, modules):
    line = line_of("centauro.yaml", "name: centauro  #")
    replace("centauro.yaml", ("name: centauro  #", wrong))
    report = check_file("centauro.yaml", modules)
    (error,) = report.errors
    assert (error.what, error.names) == (what, meant)
    assert error.where.startswith(f"centauro.yaml:{line if meant else line - 1}:")
    assert not any("did you mean" in notice.what for notice in report.warnings)


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("key", ["urdf", "srdf"])
def test_a_missing_description_is_reported_once(key):
    parameter = {"urdf": "urdf: /robot_description", "srdf": "srdf: /robot_semantic_description"}[key]
    replace("centauro.yaml", (f"      {parameter}", f"      {key}: {{file: robots/centauro/centaur.{key}}}"))
    (error,) = check_file("centauro.yaml", ["joint_states", "joint_lower", "whole_body"]).errors
    assert "there is no file" in error.what and f"source.{key}" in error.where


@pytest.mark.parametrize("content", [b"", b"\x80\x00", b"[", b"a: 1", b"mwoibn: {modules: {}}", b"mwoibn: 3"])
def test_files_that_hold_no_configuration(tmp_path, content):
    (tmp_path / "main.yaml").write_bytes(content)
    report = check_file(tmp_path / "main.yaml")
    assert report.errors and str(report.errors[0]).startswith(f"{tmp_path}/main.yaml:")
    assert report.configurations == {}


def test_a_file_that_is_not_there(tmp_path):
    (error,) = check_file(tmp_path / "main.yaml").errors
    assert "there is no file" in error.what


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("right", "wrong", "meant"),
    [
        ("      kinematics: false      # this", "      kinematcs: false      # this", "kinematics"),
        ("      model_change: false    #", "      model_chage: false    #", "model_change"),
        ("      dofs:\n        chain: all  ", "      dof:\n        chain: all  ", "dofs"),
    ],
)
def test_a_misspelt_key_is_reported_once(right, wrong, meant):
    replace("centauro.yaml", (right, wrong))
    (error,) = check_file("centauro.yaml", ["joint_states"]).errors
    assert error.names[0] == meant and error.where.startswith(
        f"centauro.yaml:{line_of('centauro.yaml', wrong.splitlines()[0])}:"
    )


@pytest.mark.usefixtures("folder")
def test_a_component_is_found_beside_the_file(tmp_path):
    package = tmp_path / "unbuilt_mover"
    code = package / "src/unbuilt_mover"
    code.mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    (code / "__init__.py").write_text("from solfer.components.joint_states import JointStates as Mover\n")
    (package / "config").mkdir()
    replace("centauro.yaml", ("class: solfer.components.joint_states:JointStates", "class: unbuilt_mover:Mover"))
    for name in ("support", "robots", "centauro.yaml"):
        (package / "config" / name).symlink_to(tmp_path / name)
    before = list(sys.path)
    for file in (package / "config" / "centauro.yaml", Path("centauro.yaml")):  # in the package, and beside it
        assert check_file(file, ["joint_lower"]).errors == ()
        assert sys.path == before
        forget("unbuilt_mover")


@pytest.mark.usefixtures("folder")
def test_an_interface_close_to_a_known_one_is_suggested():
    replace("centauro.yaml", ("velocity: true\n        effort: true", "velocty: true\n        effort: true"))
    report = check_file("centauro.yaml", ["joint_states"])
    (error,) = report.errors
    line = line_of("centauro.yaml", "velocty: true")
    assert str(error).startswith(f"centauro.yaml:{line}:")
    assert str(error).endswith("unknown interface 'velocty'\n  did you mean: velocity?")
    assert any(
        notice.mark.line == line and "has to add to the State; did you mean velocity?" in str(notice)
        for notice in report.warnings
    )


@pytest.mark.usefixtures("folder")
def test_a_sink_that_no_controller_receives_warns():
    wrong = "        sink: /comand   "
    replace("centauro.yaml", ("        sink: /command  ", wrong))
    report = check_file("centauro.yaml", ["joint_states"])
    (notice,) = report.warnings
    assert report.errors == () and "receives 'position_controller/command', not" in notice.what
    assert str(notice).startswith(f"centauro.yaml:{line_of('centauro.yaml', wrong)}:")


SOURCES = {
    "of the robot": ("source: joint_states", "source: joint_sates", "did you mean joint_states?"),
    "of a plugin": ("source: upper_body", "source: /uper_body", "did you mean upper_body?"),
    "of another one of a series": ("source: joint_states", "source: contacts/left_arm2", ""),
    "far from all": ("source: joint_states", "source: /my_lab/encoders", ""),
}


@pytest.mark.daily(2)
@pytest.mark.slow
@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(("right", "wrong", "words"), SOURCES.values(), ids=SOURCES)
@pytest.mark.parametrize("modules", [None, ["joint_states", "whole_body"]])
def test_a_source_close_to_a_published_one_warns(right, wrong, words, modules):
    replace("centauro.yaml", (right, wrong))
    report = check_file("centauro.yaml", modules)
    source = wrong.removeprefix("source: ")
    found = [notice for notice in report.warnings if f"publishes '{source}'" in notice.what]
    assert report.errors == () and [notice.mark.line for notice in found] == [line_of("centauro.yaml", wrong)] * bool(
        words
    )
    assert all(notice.what.endswith(words) for notice in found)


@pytest.mark.usefixtures("folder")
def test_pipes_that_no_plugin_uses_count_as_publishers():
    listed = "    controller:\n      position_controller:\n"
    spare = "".join(f"      spare_{index}: {{sink: /wish}}\n" for index in range(3))
    library = "\n    velocity_controller:"
    kinds = "\n    spare_0: {type: impedance}\n    spare_1: {type: reference}"
    replace("centauro.yaml", (listed, listed.replace("      p", spare + "      p")), (library, kinds + library))
    found = sinks_of([load("centauro.yaml", "joint_states")])
    assert {"spare_0/wish", "wish"} <= found and not {"spare_1/wish", "spare_2/wish"} & found
    assert {"position_controller/command", "upper_body"} <= found


@pytest.mark.slow
def test_shipped_sources_are_all_published(repository):
    """Of the main file on ROS, too, which has no warning (test_shipped.py)."""
    table = repository / "test/data/table_1.yaml"
    for file, middleware in ((repository / "config/centauro.yaml", "XBOT"), (table, "XBOT"), (table, "ROS")):
        report = check_file(file, middleware=middleware)
        assert not [str(notice) for notice in report.warnings if "neither the simulated" in notice.what]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "after, tag, words",
    [
        ("      position_controller:\n", "        load_service: /load\n", "'source.controller' names no file of gains"),
        ("      upper_body:\n        sink", "        ff_service: /on\n", "does not lead to the lower level"),
        ("      link_side_online:\n", "        sensor: imu_link\n", "with `layer: online` reads a sensor"),
        ("    source:   ", "      config: {file: nowhere.yaml}\n", "has no effect: there is no file"),
    ],
)
def test_tags_without_effect_are_warnings(after, tag, words):
    text = Path("centauro.yaml").read_text()
    begin = text.index("ros: &ends")
    begin = text.index(after, text.index("    controller:\n      position", begin) if "upper" in after else begin)
    end = text.index("\n", begin) + 1
    Path("centauro.yaml").write_text(text[:end] + tag + text[end:])
    module = "upper_body" if "upper" in after else "joint_states"
    report = check_file("centauro.yaml", [module])
    assert report.errors == ()
    assert any(
        notice.mark.line == line_of("centauro.yaml", tag.strip()) and words in str(notice) for notice in report.warnings
    )


@pytest.mark.usefixtures("folder")
def test_a_missing_file_of_gains_is_an_error():
    replace(
        "centauro.yaml",
        ("    source:   ", "    source:\n      controller: {file: robots/centauro/gians.yaml}\n      #"),
    )
    (error,) = check_file("centauro.yaml", ["joint_states"]).errors
    assert error.names[:1] == ("gains.yaml",) and "centauro.yaml:" in error.where

"""One mistake at a time in a configuration that is correct otherwise: its place, and its message."""

import re
import shutil

import pytest

from solfer.config import load
from solfer.errors import SolferError, SolferErrors
from solfer.plugins import check_file

MISTAKES = [
    # (file, written there, instead, line:column of the message, its words)
    ("main", "middleware: ROS", "middleware: ROS2", "2:15", r"expected 'ROS' or 'XBOT', got 'ROS2'.*mean: ROS"),
    ("main", "system: SM", "system: sim", "3:11", r"expected 'HW' or 'SM', got 'sim'"),
    ("main", "system: SM", "system: HW", "3:11", r"unknown system 'HW'.*one of SM"),
    ("main", "  feedbacks:", "  feedbcks:", "18:3", r"unknown key 'feedbcks'.*mean: feedbacks"),
    ("main", "file: layer.yaml", "file: laver.yaml", "5:17", r"no file 'laver.yaml'.*mean: layer.yaml"),
    ("main", "file: layer.yaml", "fil: layer.yaml", "5:11", r"unknown key 'fil'.*mean: file"),
    ("main", "NRT: {file", "NTR: {file", "5:5", r"unknown key 'NTR'.*mean: NRT"),
    ("main", "name: robi", "name: 7", "7:11", r"expected a text, got 7"),
    ("main", "layer: measured", "layer: mesured", "11:25", r"unknown feedback set 'mesured'.*mean: measured"),
    ("main", "layer: measured", "layre: measured", "11:18", r"unknown key 'layre'.*mean: layer"),
    ("main", "actuators: {read: true}", "actuators: {read: on}", "12:25", r"expected true or false, got 'on'"),
    ("main", "actuators: {read: true}", "actuators: {}", "12:7", r"the key 'read' is missing"),
    ("main", "contacts: {read: false}", "contacts: {read: true}", "42:5", r"'contacts' is missing.*'online' reads"),
    ("secondary", "[joints]", "[joint]", "5:16", r"unknown feedback pipe 'joint'.*mean: joints"),
    ("secondary", "[joints]", "joints", "5:15", r"expected a list of pipes, got 'joints'"),
    ("secondary", "[joints]", "[joints, joints]", "5:24", r"the pipe 'joints' stands twice"),
    ("secondary", "[joints]", "[3]", "5:16", r"expected the name of a pipe, got 3"),
    ("secondary", "mwoibn:", "mwobn:", "1:1", r"there is no 'mwoibn' here; mwobn found instead"),
    ("secondary", "mover: {", "mover: {layer: RT, ", "3:13", r"'layer' has no effect in this file"),
    ("secondary", "feedbacks:", "system: HW\n  feedbacks:", "4:3", r"'system' has no effect in this file"),
    ("secondary", "    mover: {", "   mover: [", "3:51", r"not YAML"),
    ("secondary", "measured: [joints]", "measured: []\n  feedback: {joints: {dofs: 3}}", "6:29", r"3 cannot replace"),
    ("layer", "rate: 200", "rate: fast", "2:17", r"expected a number, got 'fast'"),
    ("layer", "rate: 200", "rate: 0", "2:17", r"expected a number of at least 1, got 0"),
    ("layer", "rate: 200", "rate: .nan", "2:17", r"expected a finite number, got nan"),
    ("layer", "robot:", "robott:", "2:3", r"unknown key 'robott'.*mean: robot"),
    ("layer", "  robot:", "\trobot:", "2:1", r"a tab in the indentation"),
    ("main", "[position, broadcast]", "[positon, broadcast]", "21:21", r"unknown controller pipe 'positon'.*position"),
    ("main", "direct: {list", "direct: {lst", "21:14", r"unknown key 'lst'.*mean: list"),
    ("main", "    joints:\n      space: JOINT", "    joints:\n      space: JOIN", "24:14", r"got 'JOIN'.*mean: JOINT"),
    ("main", "chain: all, type: actuated", "type: actuated", "25:7", r"the key 'chain' is missing.*SRDF group"),
    ("main", "chain: all, type: actuated", "chian: all, chain: all, type: all", "25:14", r"unknown key 'chian'.*chain"),
    ("main", "type: actuated, mapping: F", "type: body, mapping: F", "25:13", r"'body' needs the key 'name'"),
    ("main", "velocity: true}", "velocity: yes}", "26:45", r"expected true or false, got 'yes'"),
    ("main", "velocity: true}", "velocity: true, torque: true}", "26:18", r"expected effort: true"),
    ("main", "velocity: true}", "velocity: true, bias: 3}", "26:57", r"expected true or false, got 3"),
    ("main", "function: state", "function: sate", "27:17", r"got 'sate'.*mean: state"),
    ("main", "      function: state\n", "", "49:7", r"the pipe 'joints' has no 'function'"),
    ("main", "joints: {source: joint_states, ", "joints: {", "50:7", r"no 'source'.*ros.feedback.joints.source"),
    ("main", "initialize: true}", "initialize: 1}", "50:86", r"expected true or false, got 1"),
    ("main", "{type: custom_controller/A", "{type: custom_kontroller/A", "53:24", r"expected 'reference', 'impedance'"),
    ("main", "broadcast: {sink: desired_state}", "broadcast: {}", "54:7", r"the pipe 'broadcast' has no 'sink'"),
    ("main", "srdf: {file: robi.srdf}", "srdf: {file: rob.srdf}", "44:20", r"no file 'rob.srdf'.*mean: robi.srdf"),
    ("main", "urdf: /robot\n", "udrf: /robot\n", "43:7", r"unknown key 'udrf'.*mean: urdf"),
    ("main", "urdf: /robot\n", "urdf: {path: a}\n", "42:5", r"the key 'urdf' is missing"),
    ("main", "urdf: /legs", "urdf: {path: a}", "48:13", r"'urdf' names neither a parameter nor a file"),
    ("main", "urdf: /legs", "urdf: {parameter: /a, file: a}", "48:36", r"expected a parameter or a file, got both"),
    ("main", "LEGS: {loading: model, urdf", "LEGS: {loading: modl, urdf", "48:23", r"got 'modl'.*mean: model"),
    ("main", "loading: topic, source: joint_states, ", "loading: topic, ", "47:15", r"needs the key 'source'"),
    ("main", "      robot: online\n", "      robot: onlin\n", "58:14", r"robot configuration 'onlin'.*mean: online"),
    ("main", "controller: direct\n", "controller: direkt\n", "59:19", r"unknown controller set 'direkt'.*direct"),
    ("main", "controller: direct\n", "controller: {list: [position]}\n", "59:19", r"expected a text or a list"),
    ("secondary", "mode: idle", "mode: Idle", "3:48", r"expected 'full' or 'idle', got 'Idle'.*mean: idle"),
    ("main", "      dynamics: false\n", "", "56:5", r"the key 'dynamics' is missing"),
    ("main", "file: secondary.yaml", "file: second.yaml", "64:39", r"no file 'second.yaml'.*mean: secondary.yaml"),
    ("main", "      speed: 0.5", "      mode: idle", "65:7", r"the key 'mode' stands twice.*line 60"),
    pytest.param(
        *("main", "path: ., file", "path: package://no_such_pkg_at_all, file", "64:30", r"unknown package"),
        marks=pytest.mark.needs("ros"),
    ),
    ("main", "file: secondary.yaml", "file: main.yaml", "64:23", r"the main file cannot be laid over itself"),
    ("main", "layer: NRT\n", "layer: RT\n", "57:14", r"unknown layer 'RT'.*mean: NRT"),
    ("main", "controller: [broadcast]", "controller: [brodcast]", "69:20", r"pipe 'brodcast'.*mean: broadcast"),
    ("main", "class: my_package.player:Player", "class: Player", "74:14", r"'Player' is not the name of a class"),
    ("main", "class: my_package.player:Player", "class: solfer.components.joint_states:Joint", "74:14", r"JointStates"),
    ("main", "    player:\n", "    shared: {layer: NRT, plugins: [joint_states::plaier]}\n    player:\n", "66:36",
     r"configuration of the plugin 'joint_states'.*mean: player"),
    ("main", "    player:\n", "    shared: {layer: NRT, plugins: [joint_state::mover]}\n    player:\n", "66:36",
     r"unknown plugin 'joint_state'.*mean: joint_states"),
    ("main", "    player:\n", "    shared: {layer: NRT, plugins: [a::none]}\n    none:\n    player:\n", "67:5",
     r"the module 'none' is empty"),
    ("main", "    player:\n", "    shared: {layer: NRT, plugins: ['::player']}\n    player:\n", "66:36",
     r"'::player' names no plugin.*plugin::configuration"),
    ("main", "    player:\n", "    shared: {plugins: [joint_states::player]}\n    player:\n", "66:5",
     r"the key 'layer' is missing"),
    ("main", "    player:\n", "    shared: {layer: NRT, kinematics: true}\n    player:\n", "66:26",
     r"unknown key 'kinematics'"),
    ("main", "chain: arm", "chain: amr", "35:21", r"unknown group 'amr'.*mean: arm"),
    ("main", "mapping: LOWER_LEVEL", "mapping: LOWER_LEVL", "35:51", r"unknown map 'LOWER_LEVL'.*mean: LOWER_LEVEL"),
    ("main", "type: actuated, mapping: F", "type: actuatd, mapping: F", "25:32", r"type of DoFs 'actuatd'.*actuated"),
    ("secondary", "feedbacks:", "feedback: {joints: {dofs: {type: body, name: uper_arm}}}\n  feedbacks:", "4:48",
     r"unknown link 'uper_arm'.*mean: upper_arm"),
    ("secondary", "mover: {", "mover: {secondary_file: {file: secondary.yaml}, ", "3:13",
     r"'secondary_file' has no effect in this file"),
    ("layer", "rate: 200", "rate: 1e-3x", "2:17", r"expected a number, got '1e-3x'"),
    ("main", "      kinematics: false", "      kinematics: 1e-3", "61:19", r"expected true or false, got 0.001"),
    ("main", "name: robi", "name: *robi", "7:11", r"no anchor '&robi' is complete before this place"),
    ("main", "name: robi", "name: !!int robi", "7:11", r"'robi' is not of the tag's kind '!!int'"),
    ("main", "  feedbacks:", "  <<: 3\n  feedbacks:", "18:7", r"expected a map behind '<<', got 3"),
    ("layer", "  robot:", "---\n  robot:", "2:1", r"a second YAML document begins here.*one document"),
    ("layer", "  robot:", "  ? [a]\n  : b\n  robot:", "2:5", r"a key has to be a plain word"),
    ("main", "function: state", "function: state\n      filter: {frequency: 0}", "28:27", r"at least 0.001, got 0"),
    ("main", "      space: JOINT", "      space: {}", "24:14", r"expected 'JOINT'.*got a map"),
    ("main", "[joints, desired]", "[all, desired]", "19:16", r"unknown feedback pipe 'all'"),
    ("main", "broadcast: {sink: desired_state}", "broadcast: {sink: desired_state, calibration: encoders}", "54:53",
     r"unknown calibration 'encoders'"),
    ("main", "  modules:", "  calibration: {encoders: {joints: {elbw: {}}}}\n  modules:", "55:37",
     r"unknown joint 'elbw'.*mean: elbow"),
]  # fmt: skip


@pytest.fixture
def folder(repository, tmp_path, monkeypatch):
    """Copy the configuration, and make it the working directory."""
    shutil.copytree(repository / "test/data/config", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(("name", "right", "wrong", "place", "words"), MISTAKES, ids=lambda value: str(value)[:30])
def test_a_mistake_is_placed_and_explained(folder, name, right, wrong, place, words):
    file = folder / f"{name}.yaml"
    text = file.read_text()
    assert right in text
    file.write_text(text.replace(right, wrong, 1))
    messages = [str(error) for error in check_file("main.yaml").errors]
    placed = [message for message in messages if message.startswith(f"{name}.yaml:{place}:")]
    assert any(re.search(words, message, re.DOTALL) for message in placed), messages


def test_several_mistakes_are_reported_at_once(folder):
    for name, right, wrong in [
        ("main", "function: state", "function: stat"),
        ("main", "kinematics: false", "kinematics: no"),
        ("main", "sink: /command", "snik: /command"),
        ("main", "srdf: {file: robi.srdf}", "srdf: {file: rob.srdf}"),
        ("layer", "rate: 200", "rate: -1"),
        ("secondary", "mode: idle", "layer: RT"),
        ("system", "speed: 1", "speed: 1, speed: 2"),
    ]:
        file = folder / f"{name}.yaml"
        file.write_text(file.read_text().replace(right, wrong, 1))
    with pytest.raises(SolferErrors) as caught:
        load("main.yaml", "mover")
    places = [":".join(error.where.split(":")[:2]) for error in caught.value.errors]
    assert places == [
        "main.yaml:27", "main.yaml:44", "main.yaml:53", "main.yaml:61", "system.yaml:4", "layer.yaml:2",
        "secondary.yaml:3",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        (b"", "1:1", "the file is empty"),
        (b"# nothing\n", "1:1", "the file is empty"),
        (b"\x7fELF\x02\x01\x00\xf0", "1:8", "not a text in UTF-8"),
        (b"a\x00b", "1:1", "characters that YAML forbids"),
        (b"- a\n", "1:1", "there is no 'mwoibn' here"),
        (b"mwoibn: {robot: {rate: 200}", "2:1", "not YAML"),
        (b"mwoibn:\n  robot: {rate: 200}\n  robot: {rate: 100}\n", "3:3", "the key 'robot' stands twice"),
        (b"mwoibn: 200\n", "1:9", "200 cannot replace a map"),
    ],
)
@pytest.mark.parametrize("name", ["layer", "secondary", "system"])
def test_files_that_hold_something_else(folder, name, content, place, words):
    (folder / f"{name}.yaml").write_bytes(content)
    messages = [str(error) for error in check_file("main.yaml").errors]
    assert any(message.startswith(f"{name}.yaml:{place}:") and words in message for message in messages), messages


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("mwoibn:\n", "there are no modules here"),
        ("mwoibn: 3\n", "there are no modules here"),
        ("mwoibn: {modules: [a]}\n", "there are no modules here"),
        ("mwoibn: {modules: {a: }}\n", "unknown module 'mover'"),
        ("mwoibn: {modules: {mover: }}\n", "the module 'mover' is empty"),
        ("mwoibn: {modules: {mover: 3}}\n", "expected a map of keys, got 3"),
        ("mwoibn: {modules: {mover: {plugins: [a]}}}\n", "'mover' lists plugins"),
        ("mwoibn: {modules: {mover: {}}, robot: {}}\n", "the key 'layer' is missing"),
    ],
)
def test_main_files_that_are_hardly_there(folder, text, words):
    (folder / "main.yaml").write_text(text)
    with pytest.raises(SolferError, match=words):
        load("main.yaml", "mover")

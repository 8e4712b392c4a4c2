"""Contracts that unitree_rl_lab, Isaac Lab and rl_sar write: each gives the actions of solfer's own tags."""

import re

import numpy as np
import pytest
from support import robots
from support.unit import onnx_files

from solfer.components.policy import Policy
from solfer.config import read
from solfer.errors import SolferError
from solfer.interfaces.geometry import Twist, Vector

pytest.importorskip("onnxruntime", reason="needs pip install -r requirements-policy.txt")

JOINTS = ["j_arm1_1", "j_arm1_2", "j_arm1_3"]
MOTORS = ["j_arm1_3", "j_arm1_4", "j_arm1_1", "j_arm1_2"]  # one of which the network does not move

TAGS = """
joints: [j_arm1_1, j_arm1_2, j_arm1_3]
default: [0.1, -0.2, 0.3]
observations:
  - {term: angular_velocity, scale: 0.25, history: HISTORY, clip: 0.125}
  - {term: commands, scale: [2.0, 2.0, 0.5], history: HISTORY}
  - {term: joint_position, history: HISTORY}
  - {term: joint_velocity, scale: 0.05, history: HISTORY}
  - {term: last_action, history: HISTORY}
action: {scale: [0.1, 0.2, 0.3]}
gains: {stiffness: [10.0, 20.0, 30.0], damping: [1.0, 2.0, 3.0]}
rate: 100.0
"""

UNITREE = """
joint_ids_map: [2, 3, 0]
step_dt: 0.01
stiffness: [30.0, 99.0, 10.0, 20.0]
damping: [3.0, 99.0, 1.0, 2.0]
default_joint_pos: [0.1, -0.2, 0.3]
commands:
  base_velocity:
    ranges: {lin_vel_x: [-0.5, 0.25], lin_vel_y: [-0.3, 0.3], ang_vel_z: [-1.0, 1.0], heading: null}
actions:
  JointPositionAction:
    clip: null
    joint_names: [.*]
    scale: [0.1, 0.2, 0.3]
    offset: [0.1, -0.2, 0.3]
    joint_ids: !!python/object/apply:builtins.slice [null, null, null]
observations:
  base_ang_vel: {params: {}, clip: !!python/tuple [-0.5, 0.5], scale: [0.25, 0.25, 0.25], history_length: 2}
  velocity_commands: {params: {command_name: base_velocity}, clip: null, scale: [2.0, 2.0, 0.5], history_length: 2}
  joint_pos_rel: {params: {}, clip: null, scale: [1.0, 1.0, 1.0], history_length: 2}
  joint_vel_rel: {params: {}, clip: null, scale: [0.05, 0.05, 0.05], history_length: 2}
  last_action: {params: {}, clip: null, scale: [1.0, 1.0, 1.0], history_length: 2}
"""

ISAAC = """
actions:
- full_path: isaaclab.envs.mdp.actions.joint_actions.JointPositionAction
  clip: null
  joint_names: [j_arm1_1, j_arm1_2, j_arm1_3]
  name: joint_position_action
  offset: [0.1, -0.2, 0.3]
  scale: [0.1, 0.2, 0.3]
  shape: !!python/tuple [3]
articulations:
  robot:
    joint_names: [j_arm1_3, j_arm1_4, j_arm1_1, j_arm1_2]
    default_joint_pos: [0.3, 0.0, 0.1, -0.2]
    default_joint_stiffness: [30.0, 99.0, 10.0, 20.0]
    default_joint_damping: [3.0, 99.0, 1.0, 2.0]
observations:
  policy:
  - {name: base_ang_vel, overloads: {clip: [-0.5, 0.5], history_length: 2, scale: 0.25}}
  - {name: generated_commands, overloads: {clip: null, history_length: 2, scale: [2.0, 2.0, 0.5]}}
  - {name: joint_pos_rel, joint_names: [j_arm1_1, j_arm1_2, j_arm1_3], overloads: {history_length: 2, scale: null}}
  - {name: joint_vel_rel, joint_names: [j_arm1_1, j_arm1_2, j_arm1_3], overloads: {history_length: 2, scale: 0.05}}
  - {name: last_action, overloads: {clip: null, history_length: 2, scale: null}}
scene: {decimation: 4, dt: 0.01, physics_dt: 0.0025}
"""

RL_SAR = """
arm/walk:
  model_name: network.onnx
  observations: [ang_vel, commands, dof_pos, dof_vel, actions]
  observations_history: [1, 0]
  observations_history_priority: term
  clip_obs: 100.0
  clip_actions_lower: [-100.0, -100.0, -100.0]
  clip_actions_upper: [100.0, 100.0, 100.0]
  rl_kp: [10.0, 20.0, 30.0]
  rl_kd: [1.0, 2.0, 3.0]
  action_scale: [0.1, 0.2, 0.3]
  wheel_indices: []
  ang_vel_scale: 0.25
  dof_pos_scale: 1.0
  dof_vel_scale: 0.05
  commands_scale: [2.0, 2.0, 0.5]
  default_dof_pos: [0.1, -0.2, 0.3]
  joint_mapping: [2, 3, 0]
"""

BASE = """
arm:
  dt: 0.0025
  decimation: 4
  default_dof_pos: [9.0, 9.0, 9.0]
  joint_names: [j_arm1_3, j_arm1_4, j_arm1_1, j_arm1_2]
  joint_mapping: [0, 1, 2, 3]
"""

FILES = {"unitree": UNITREE, "isaac": ISAAC, "rl_sar": RL_SAR}


def written(folder, text, more=""):
    """Write a network, a contract, and tags that name both; returns the file of the tags."""
    deep = folder / "arm/walk"
    deep.mkdir(parents=True, exist_ok=True)
    (folder / "arm/base.yaml").write_text(BASE)
    (deep / "contract.yaml").write_text(text)
    rng = np.random.default_rng(1)
    onnx_files.linear(folder / "network.onnx", rng.normal(size=(30, 3)), rng.normal(size=3))
    tags = folder / "policy.yaml"
    tags.write_text(f"file: network.onnx\nstart_tolerance: 10.0\n{more or 'contract: arm/walk/contract.yaml'}\n")
    return tags


def component(file):
    made = Policy(robots.centauro("mammal_wide_straight", actuators=True), read(file, Policy.Tags))
    made.set_rate(200.0)
    made.init()
    return made


def steps(made):
    """Yield the actions of five steps with other states, and the gains."""
    rng = np.random.default_rng(2)
    for _ in range(5):
        made.model.state.position[6:] = rng.uniform(-0.5, 0.5, made.model.size - 6)
        made.model.state.velocity[:] = rng.uniform(-2.0, 2.0, made.model.size)
        made.model.update()
        made.receive(Twist(Vector(0.2, -0.1, 0.0), Vector(0.0, 0.0, 0.3)))
        made.update()
        made.send()
        made.let_pass(0.01)
        command = made.model.command
        yield np.concatenate((command.position, command["stiffness"], command["damping"]))


@pytest.mark.parametrize("kind", FILES)
def test_actions_are_those_of_the_tags(tmp_path, kind):
    """Also the gains and the rate; rl_sar bounds no angular velocity before its scale."""
    own = TAGS.replace("HISTORY", "2").replace(", clip: 0.125", "" if kind == "rl_sar" else ", clip: 0.125")
    expected = component(written(tmp_path, "{}", own))
    motors = f"contract: arm/walk/contract.yaml\nmotors: {MOTORS}" if kind == "unitree" else ""
    found = component(written(tmp_path, FILES[kind], motors))
    assert list(found.contract.joints) == JOINTS and found.contract.rate == pytest.approx(100.0)
    assert np.abs(np.array([*steps(found)]) - np.array([*steps(expected)])).max() < 1e-6
    assert found.steps == expected.steps == 5


@pytest.mark.parametrize(("ids", "newest"), [("[1, 0]", 1), ("[0, 1]", 0)])
def test_steps_of_all_terms_may_stand_together(tmp_path, ids, newest):
    """As rl_sar orders them by time."""
    made = component(written(tmp_path, RL_SAR.replace("[1, 0]", ids).replace("priority: term", "priority: time")))
    [*steps(made)]
    halves = made.network.observations.reshape(2, 15)
    state, dofs = made.model.state, made.contract.dofs
    assert halves[newest][6:9] == pytest.approx(state.position[dofs] - made.contract.default)
    assert halves[newest][9:12] == pytest.approx(0.05 * state.velocity[dofs])
    assert np.abs(halves[0] - halves[1])[9:12].min() > 1e-6


def test_tags_take_precedence_and_commands_stay_in_their_range(tmp_path):
    tags = f"contract: arm/walk/contract.yaml\nmotors: {MOTORS}\n"
    made = component(written(tmp_path, UNITREE, tags + "gains: {damping: 7.0}\nrate: 50.0\naction: {scale: 0.5}"))
    assert made.contract.rate == 50.0 and (made.contract.gains["damping"] == 7.0).all()
    assert np.array_equal(made.contract.gains["stiffness"], [10.0, 20.0, 30.0]) and (made.contract.scale == 0.5).all()
    made.receive(Twist(Vector(3.0, -0.1, 0.0), Vector(0.0, 0.0, -9.0)))
    made.update()
    assert made.network.observations[9:12] == pytest.approx((0.5, -0.2, -0.5))  # scaled; the newest of two steps
    made = component(written(tmp_path, UNITREE, tags + "command_range: {x: [0.0, 2.0]}"))
    made.receive(Twist(Vector(3.0, -9.0, 0.0), Vector()))
    assert made.contract.commands.tolist() == [[0.0, -1e5, -1e5], [2.0, 1e5, 1e5]]


def test_a_phase_begins_as_unitree_counts_it(tmp_path):
    text = re.sub(r"  base_ang_vel:.*\n", "", UNITREE).replace("history_length: 2", "history_length: 1")
    text += "  gait_phase: {params: {period: 0.8}, clip: null, scale: [1.0, 1.0], history_length: 1}\n"
    file = written(tmp_path, text, f"contract: arm/walk/contract.yaml\nmotors: {MOTORS}")
    onnx_files.linear(tmp_path / "network.onnx", np.zeros((14, 3)), np.zeros(3))
    made = component(file)
    for step in range(1, 4):
        made.update()
        angle = 2.0 * np.pi * step * 0.01 / 0.8
        assert made.network.observations[-2:] == pytest.approx((np.sin(angle), np.cos(angle)), abs=1e-6)
        made.let_pass(0.01)


def test_targets_are_bounded_as_isaac_lab_does(tmp_path):
    bounds = "clip: [[-0.1, 0.1], [-0.2, 0.0], [0.3, 0.3]]"
    file = written(tmp_path, ISAAC.replace("  clip: null", f"  {bounds}", 1))
    found = np.array([each[component(file).contract.dofs] for each in steps(component(file))])
    assert (found >= (-0.1, -0.2, 0.3)).all() and (found <= (0.1, 0.0, 0.3)).all()
    assert (found[:, 0] == -0.1).any() and (found[:, 0] == 0.1).any()


REFUSALS = [
    ("unitree", "joint_ids_map: [2, 3, 0]", "joint_ids_map: [2, 3, 4]", ":2:23:.*number 4 of 4 motors", "from 0 to 3"),
    ("unitree", "joint_ids_map: [2, 3, 0]", "joint_ids_map: [2, 3, 2]", ":2:23:.*number 2 stands twice", "once"),
    ("unitree", "step_dt: 0.01", "step_dt: fast", ":3:1:.*'fast' instead of a number", "above zero"),
    ("unitree", "step_dt: 0.01", "", ":2:1:.*no 'step_dt'", "exporter"),
    ("unitree", "damping: [3.0,", "damping: [x,", ":5:11:.*'x' in a list of numbers", "numbers"),
    ("unitree", "  last_action:", "  last_acton:", ":22:3:.*unknown term 'last_acton'", "last_action"),
    ("unitree", "[-0.5, 0.5]", "[-0.5, 0.6]", ":18:30:.*bounds .-0.5, 0.6. before a scale", "one scale"),
    ("unitree", "offset: [0.1,", "offset: [0.2,", ":15:5:.*offset", "0.1"),
    ("unitree", "JointPositionAction", "JointPositionActoin", ":11:3:.*unknown action", "JointPositionAction"),
    ("unitree", "[null, null, null]", "[0, 1]", ":16:5:.*some of the joints", "all"),
    ("unitree", "default_joint_pos: [0.1,", "default_joint_pos: [9.0, 0.1,", ":15:5:.*offset", ""),
    ("unitree", "lin_vel_x: [-0.5, 0.25]", "lin_vel_x: [0.5, 0.25]", ":9:.*begins at 0.5", "smaller one first"),
    (
        "isaac",
        "[j_arm1_1, j_arm1_2, j_arm1_3]\n  name",
        "[j_arm1_1, j_arm1_2, j_arm1_9]\n  name",
        ":5:37:.*j_arm1_9",
        "",
    ),
    ("isaac", "default_joint_pos: [0.3, 0.0,", "default_joint_pos: [", ":13:5:.*there are 2 numbers", "4 or more"),
    ("isaac", "name: base_ang_vel", "name: height_scan", ":18:6:.*unknown term 'height_scan'", ""),
    ("rl_sar", "wheel_indices: []", "wheel_indices: [2]", ":13:3:.*wheels are moved by velocities", "one kind"),
    ("rl_sar", "[1, 0]", "[2, 0]", ":5:3:.*a history of the steps", "all steps"),
    ("rl_sar", "joint_mapping: [2, 3, 0]", "joint_mapping: [2, 3, 7]", ":19:25:.*number 7 of 4 joints", "from 0 to 3"),
    ("rl_sar", "rl_kp: [10.0, 20.0, 30.0]", "rl_kp: [10.0]", ":10:10:.*1 numbers of 'gains.stiffness'", "one for all"),
    ("rl_sar", "clip_actions_lower: [-100.0", "clip_actions_lower: [-9.0", ":8:3:.*different bounds", "one amount"),
    (
        "rl_sar",
        "arm/walk:",
        "arm/walk: &x\n  x: !!python/object/apply:os.system [touch /tmp/x]\n  y: *z",
        ":4:.*anchor",
        "",
    ),
]


@pytest.mark.parametrize(("kind", "old", "new", "message", "expected"), REFUSALS)
def test_refusals_have_their_place_in_the_file(tmp_path, kind, old, new, message, expected):
    assert old in FILES[kind]
    motors = f"contract: arm/walk/contract.yaml\nmotors: {MOTORS}" if kind == "unitree" else ""
    file = written(tmp_path, FILES[kind].replace(old, new, 1), motors)
    with pytest.raises(SolferError, match=f"contract.yaml{message}") as refused:
        component(file)
    assert expected in str(refused.value)


def test_a_contract_without_names_needs_them(tmp_path):
    with pytest.raises(SolferError, match="neither the tag `joints`"):
        component(written(tmp_path, UNITREE))


def test_tags_of_python_are_not_run(tmp_path):
    """A file may name any function of Python; it is read as the list that stands behind the name."""
    path = tmp_path / "made"
    harm = f"heading: !!python/object/apply:os.mkdir ['{path}']"
    file = written(
        tmp_path, UNITREE.replace("heading: null", harm), f"contract: arm/walk/contract.yaml\nmotors: {MOTORS}"
    )
    assert component(file).contract.rate == pytest.approx(100.0) and not path.exists()

"""The component `policy` on CENTAURO, with tiny networks that are made here: law, names, rates, states, refusals."""

import math
import sys
from itertools import permutations

import numpy as np
import pytest
from support import robots
from support.unit import onnx_files

from solfer.components.policy import Policy
from solfer.config import read
from solfer.errors import MissingDependency, NotFinite, SolferError
from solfer.interfaces.geometry import Twist, Vector

pytest.importorskip("onnxruntime", reason="needs pip install -r requirements-policy.txt")

RATE = 200.0  # [Hz]
JOINTS = ("j_arm1_1", "j_arm1_2", "j_arm1_3")
DEFAULT = (0.1, -0.2, 0.3)
TERMS = ("joint_position", "joint_velocity", "last_action")


def centauro():
    return robots.centauro("mammal_wide_straight", actuators=True)


def policy(file, robot=None, rate=RATE, **tags):
    """Make a policy that runs, of joints whose default pose is where the robot is not."""
    tags = {"joints": JOINTS, "default": DEFAULT, "observations": terms(*TERMS), "start_tolerance": 10.0, **tags}
    component = Policy(robot or centauro(), Policy.Tags(file=str(file), **tags))
    component.set_rate(rate)
    component.init()
    return component


def terms(*names, **keys):
    return tuple({"term": name, **keys} for name in names)


def cycle(component, count=1):
    for _ in range(count):
        component.update()
        component.send()
    return component.model.command


def random_network(path, observations, actions=3, **options):
    rng = np.random.default_rng(observations)
    weights = rng.normal(size=(observations, actions)).astype(np.float32)
    offset = rng.normal(size=actions).astype(np.float32)
    return onnx_files.linear(path / "network.onnx", weights, offset, **options), weights, offset


def moved(robot, seed):
    """Put a robot somewhere, moving."""
    rng = np.random.default_rng(seed)
    robot.state.position[:] = rng.uniform(-0.5, 0.5, robot.size)
    robot.state.velocity[:] = rng.uniform(-0.5, 0.5, robot.size)
    robot.update()


@pytest.mark.parametrize("kind", ["position", "velocity", "torque"])
def test_actions_are_those_of_numpy(tmp_path, kind):
    """All terms with scales, bounds and histories, in steps with other states, by matrices that Pinocchio computes."""
    names = ("linear_velocity", "commands", "angular_velocity", "projected_gravity", *TERMS, "phase")
    histories = (1, 2, 1, 3, 2, 1, 2, 1)
    scale, clip, period = 0.7, 0.6, 0.8
    widths = (3, 3, 3, 3, 3, 3, 3, 4)
    file, weights, offset = random_network(tmp_path, int(np.dot(widths, histories)))
    listed = tuple(
        {"term": name, "scale": scale, "clip": clip, "history": history}
        | ({"period": period, "offsets": (0.0, 0.5)} if name == "phase" else {})
        for name, history in zip(names, histories, strict=True)
    )
    factors = (0.1, 0.2, 0.3)
    component = policy(
        file, observations=listed, rate=50.0, largest_tilt=3.2, action={"kind": kind, "scale": factors, "clip": 2.0}
    )
    robot = component.model
    dofs = [robot.dof(name) for name in JOINTS]
    past, action = [], np.zeros(3)
    for step in range(6):
        moved(robot, step)
        component.receive(Twist(Vector(0.3, step, 0.0), Vector(0.0, 0.0, -0.2)))
        command = cycle(component)
        rotation = robot.kinematics.rotation("pelvis")
        twist = base_twist(robot)
        angles = 2.0 * math.pi * (step * 0.02 / period + np.array([0.0, 0.5]))
        numbers = {
            "linear_velocity": rotation.T @ twist[:3],
            "commands": (0.3, step, -0.2),
            "angular_velocity": rotation.T @ twist[3:],
            "projected_gravity": rotation.T @ (0.0, 0.0, -1.0),
            "joint_position": robot.state.position[dofs] - DEFAULT,
            "joint_velocity": robot.state.velocity[dofs],
            "last_action": action,
            "phase": np.concatenate((np.sin(angles), np.cos(angles))),
        }
        scaled = {name: np.clip(scale * np.asarray(each), -clip, clip) for name, each in numbers.items()}
        past = [*past, scaled] if past else [scaled] * 4
        observed = np.concatenate(
            [each[name] for name, history in zip(names, histories, strict=True) for each in past[-history:]]
        )
        action = np.clip(observed @ weights + offset, -2.0, 2.0)
        target = action * factors + (DEFAULT if kind == "position" else 0.0)
        assert np.abs(command[kind][dofs] - target).max() < 1e-6


def base_twist(robot):
    """Compute linear and angular velocity of the base in world axes, by finite differences of its pose."""
    step = 1e-6
    position, velocity = robot.state.position.copy(), robot.state.velocity
    poses = []
    for sign in (-1.0, 1.0):
        robot.kinematics.update(position + sign * step * velocity, velocity)
        poses.append((robot.kinematics.rotation("pelvis").copy(), robot.kinematics.position("pelvis").copy()))
    robot.kinematics.update(position, velocity)
    (before, start), (after, end) = poses
    turn = after @ before.T / (2.0 * step)
    return np.concatenate(((end - start) / (2.0 * step), (turn[2, 1], turn[0, 2], turn[1, 0])))


def test_joints_are_bound_by_name(tmp_path):
    """Each order of the joints, with weights in that order, gives each joint the same command."""
    _, weights, offset = random_network(tmp_path, 9)
    found = []
    for order in permutations(range(3)):
        rows = [block + each for block in (0, 3, 6) for each in order]
        file = onnx_files.linear(tmp_path / "ordered.onnx", weights[np.ix_(rows, order)], offset[list(order)])
        component = policy(
            file,
            joints=tuple(JOINTS[each] for each in order),
            default=dict(zip(JOINTS, DEFAULT, strict=True)),
            action={"scale": tuple((0.1, 0.2, 0.3)[each] for each in order)},
            gains={"stiffness": {JOINTS[0]: 10.0, JOINTS[2]: 30.0, JOINTS[1]: 20.0}},
        )
        moved(component.model, 3)
        command = cycle(component, 10)
        found.append(np.concatenate((command.position, command["stiffness"])))
    assert np.abs(np.array(found) - found[0]).max() < 1e-6
    robot = centauro()
    stiffness = found[0][robot.size :]
    assert [stiffness[robot.dof(name)] for name in JOINTS] == [10.0, 20.0, 30.0]


def test_it_runs_at_its_own_rate_and_holds_in_between(tmp_path):
    component = policy(onnx_files.counting(tmp_path / "counting.onnx", 9, 3), action={"kind": "velocity"})
    dof = component.model.dof(JOINTS[0])
    assert [cycle(component).velocity[dof] for _ in range(9)] == [1.0] * 4 + [2.0] * 4 + [3.0]
    cycle(component, 191)
    assert component.steps == 50
    component.let_pass(0.1)  # of a loop that was late: the steps in between are lost
    component.update()
    component.let_pass(0.005)
    assert [cycle(component).velocity[dof] for _ in range(5)] == [51.0] * 3 + [52.0] * 2


@pytest.mark.parametrize("jitter", [1e-4, 1e-3])
def test_jitter_of_the_loop_does_not_change_the_rate(tmp_path, jitter):
    component = policy(onnx_files.counting(tmp_path / "counting.onnx", 9, 3))
    rng = np.random.default_rng(1)
    for _ in range(2000):
        component.let_pass(0.005 + rng.uniform(-jitter, jitter))
        component.update()
    assert component.steps == pytest.approx(500, abs=2)


def test_reset_clears_history_and_state(tmp_path):
    """The action after a reset is that after the first start, of a network that counts and of one with a history."""
    file, *_ = random_network(tmp_path, 36)
    for made in (
        policy(file, observations=terms(*TERMS, "commands", history=3)),
        policy(onnx_files.counting(tmp_path / "counting.onnx", 9, 3)),
    ):
        first = cycle(made).position.copy()
        made.receive(Twist(Vector(1.0, 0.0, 0.0)))
        made.model.state.velocity[:] = 0.3
        assert not np.array_equal(cycle(made, 10).position, first)
        made.model.state.velocity[:] = 0.0
        made.reset()
        made.init()
        assert np.array_equal(cycle(made).position, first)


def test_numbers_of_a_term_are_picked(tmp_path):
    """As holosoma orders them: the yaw rate before x and y, cosines before sines; two phases of two feet."""
    file, *_ = random_network(tmp_path, 9)
    feet = {"term": "phase", "period": 0.8, "offsets": (0.0, 0.5)}
    listed = ({"term": "commands", "pick": (2,)}, {"term": "commands", "pick": (0, 1), "history": 1})
    listed += ({**feet, "pick": (2, 3)}, {"term": "joint_position", "pick": (1, 0)}, {**feet, "pick": (0, 1)})
    component = policy(file, observations=listed, rate=50.0)
    component.receive(Twist(Vector(0.1, 0.2, 0.0), Vector(0.0, 0.0, 0.3)))
    robot = component.model
    for step in range(3):
        cycle(component, 1)
        angles = 2.0 * math.pi * (step * 0.02 / 0.8 + np.array((0.0, 0.5)))
        away = [robot.state.position[robot.dof(JOINTS[each])] - DEFAULT[each] for each in (1, 0)]
        expected = (0.3, 0.1, 0.2, *np.cos(angles), *away, *np.sin(angles))
        assert component.network.observations == pytest.approx(expected, abs=1e-6)
        component.let_pass(0.02)


def test_a_command_counts_for_half_a_second(tmp_path):
    file = onnx_files.linear(tmp_path / "commands.onnx", np.eye(3), np.zeros(3))
    component = policy(file, observations=terms("commands"), action={"kind": "velocity"}, rate=50.0)
    dofs = [component.model.dof(name) for name in JOINTS]
    assert not cycle(component).velocity[dofs].any()
    component.receive(Twist(Vector(0.5, -0.25, 9.0), Vector(9.0, 9.0, 0.125)))
    for _ in range(24):
        assert np.array_equal(cycle(component).velocity[dofs], (0.5, -0.25, 0.125))
    assert not cycle(component, 3).velocity[dofs].any()
    with pytest.raises(NotFinite, match="velocity"):
        component.receive(Twist(Vector(math.nan, 0.0, 0.0)))
    assert not cycle(component).velocity[dofs].any()


def test_a_file_that_changes_counts_at_a_restart(tmp_path):
    """The plugin has read it whole; what takes its place is read by the plugin that is made next."""
    file = onnx_files.linear(tmp_path / "network.onnx", np.zeros((9, 3)), np.full(3, 0.5))
    component = policy(file, action={"kind": "velocity"})
    dofs = [component.model.dof(name) for name in JOINTS]
    onnx_files.linear(file, np.zeros((9, 3)), np.full(3, 0.25))
    assert (cycle(component, 20).velocity[dofs] == 0.5).all()
    file.write_text("a text")
    component.reset()
    component.init()
    assert (cycle(component, 20).velocity[dofs] == 0.5).all()
    with pytest.raises(SolferError, match="is no network"):
        policy(file)


def test_a_gait_rests_while_nothing_is_commanded(tmp_path):
    """As holosoma counts: both feet at half of the period; then it begins, however long it has rested."""
    file, *_ = random_network(tmp_path, 7)
    gait = {"term": "phase", "period": 0.8, "offsets": (0.0, 0.5), "rest": 0.5}
    component = policy(file, observations=({"term": "commands"}, gait), rate=50.0)
    phases = component.network.observations[3:]
    for _ in range(2):
        for _ in range(3):
            cycle(component)
            assert phases == pytest.approx((0.0, 0.0, -1.0, -1.0), abs=1e-6)
        for step in range(3):
            component.receive(Twist(Vector(0.02, 0.0, 0.0)))
            cycle(component)
            angle = 2.0 * math.pi * step * 0.02 / 0.8
            assert phases == pytest.approx(
                (math.sin(angle), -math.sin(angle), math.cos(angle), -math.cos(angle)), abs=1e-6
            )
        component.receive(Twist(Vector(0.005, 0.005, 0.0), Vector(0.0, 0.0, 0.009)))


def test_ranges_of_commands_are_those_of_the_metadata(tmp_path):
    """As holosoma writes them; a tag wins, and both bound what is observed."""
    ranges = {"command_ranges": '{"lin_vel_x": [-1.0, 0.5], "ang_vel_yaw": [-0.25, 1.0], "heading": [-3.14, 3.14]}'}
    file = onnx_files.linear(tmp_path / "commands.onnx", np.eye(3), np.zeros(3), metadata=ranges)
    tags = {"observations": terms("commands"), "action": {"kind": "velocity"}, "rate": 50.0}
    for given, expected in (({}, (0.5, 7.0, -0.25)), ({"command_range": {"y": (-0.125, 0.125)}}, (9.0, 0.125, -9.0))):
        component = policy(file, **tags, **given)
        component.receive(Twist(Vector(9.0, 7.0, 0.0), Vector(0.0, 0.0, -9.0)))
        assert np.array_equal(cycle(component).velocity[component.contract.dofs], expected)


def test_metadata_count_where_tags_are_left_out(tmp_path):
    """As mjlab writes them, between commas, and as JSON; a tag wins."""
    for separator in (", ".join, lambda parts: "[" + ",".join(f'"{each}"' for each in parts) + "]"):
        metadata = {
            "joint_names": separator(JOINTS),
            "default_joint_pos": ",".join(map(str, DEFAULT)),
            "action_scale": "0.5",
            "joint_stiffness": "[10, 20, 30]",
            "joint_damping": "1,2,3",
            "observation_names": separator(["base_ang_vel", "joint_pos", "actions"]),
        }
        file, *_ = random_network(tmp_path, 9, metadata=metadata)
        left_out = {"joints": None, "default": None, "observations": None}
        contract = policy(file, **left_out, gains={"damping": 4.0}).contract
        assert contract.joints == JOINTS and np.array_equal(contract.default, DEFAULT)
        assert [term.term for term in contract.terms] == ["angular_velocity", "joint_position", "last_action"]
        assert np.array_equal(contract.scale, [0.5] * 3) and np.array_equal(contract.gains["stiffness"], [10, 20, 30])
        assert np.array_equal(contract.gains["damping"], [4.0] * 3)


def test_metadata_of_holosoma_count(tmp_path):
    metadata = {
        "dof_names": '["j_arm1_1", "j_arm1_2", "j_arm1_3"]',
        "kp": "[10.0, 20.0, 30.0]",
        "kd": "[1.0, 2.0, 3.0]",
    }
    file, *_ = random_network(tmp_path, 9, metadata=metadata)
    contract = policy(file, joints=None).contract
    assert contract.joints == JOINTS
    assert np.array_equal(contract.gains["stiffness"], [10.0, 20.0, 30.0])
    assert np.array_equal(contract.gains["damping"], [1.0, 2.0, 3.0])


def written(tmp_path, content="", **options):
    """Write the networks that the refusals name, and a configuration."""
    random_network(tmp_path, 9, **options)
    weights = np.zeros((9, 3))
    matmul = [onnx_files.node("MatMul", ("obs", "weights"), ("actions",))]
    ends = [onnx_files.value("obs", (1, 9))], [onnx_files.value("actions", (1, 3))]
    constants = {"weights": weights}
    onnx_files.linear(tmp_path / "nan.onnx", weights, np.full(3, math.nan))
    (tmp_path / "text.onnx").write_text("a text")
    with open(tmp_path / "large.onnx", "wb") as file:
        file.truncate(200_000_001)
    custom = [onnx_files.node("Magic", ("obs", "weights"), ("actions",), domain="com.acme")]
    onnx_files.write(tmp_path / "custom.onnx", custom, *ends, constants, domains=("", "com.acme"))
    onnx_files.write(tmp_path / "two.onnx", matmul, [*ends[0], onnx_files.value("image", (1, 4))], ends[1], constants)
    onnx_files.write(tmp_path / "open.onnx", matmul, [onnx_files.value("obs", (1, "n"))], ends[1], constants)
    onnx_files.write(
        tmp_path / "whole.onnx", matmul, [onnx_files.value("obs", (1, 9), onnx_files.INT64)], ends[1], constants
    )
    onnx_files.write(tmp_path / "lies.onnx", matmul, ends[0], [onnx_files.value("actions", (1, 4))], constants)
    named = {"joint_names": "j_arm1_1,j_arm1_x,j_arm1_3", "observation_names": "joint_pos,height_scan"}
    onnx_files.linear(tmp_path / "named.onnx", weights, np.zeros(3), metadata=named)
    ranges = {"command_ranges": '{"lin_vel_x": [1.0, -1.0]}'}
    onnx_files.linear(tmp_path / "ranges.onnx", weights, np.zeros(3), metadata=ranges)
    onnx_files.linear(tmp_path / "words.onnx", weights, np.zeros(3), metadata={"default_joint_pos": "nan,1,2"})
    tags = {
        "file": "network.onnx",
        "joints": "[j_arm1_1, j_arm1_2, j_arm1_3]",
        "default": "0.0",
        "observations": "[{term: joint_position}, {term: joint_velocity}, {term: last_action}]",
    }
    tags |= dict(part.split(": ", 1) for part in content.split("; ") if part)
    path = tmp_path / "policy.yaml"
    path.write_text("".join(f"{key}: {text}\n" for key, text in tags.items() if text != "-"))
    return path


REFUSALS = [
    ("joints: [j_arm1_1, j_arm1_2]", r":2:.*3 actions, and 2 joints", "one joint for each action"),
    ("joints: [j_arm1_1, j_arm1_2, j_arm1_3, j_arm1_4]", r":2:.*3 actions, and 4 joints", "one joint for each action"),
    ("joints: [j_arm1_1, j_arm1_2, j_arm1_1]", r":2:.*'j_arm1_1' is named twice", "each joint once"),
    ("joints: [j_arm1_1, j_arm1_2, j_arm_13]", r":2:.*unknown joint 'j_arm_13'", "j_arm1_3"),
    ("joints: [j_arm1_1, j_arm1_2, rz]", r":2:.*unknown joint 'rz'", ""),
    ("joints: -", r":1:.*neither the tag `joints` nor the metadata `joint_names`", "`joints`"),
    ("joints: -; file: named.onnx", r":1:.*unknown joint 'j_arm1_x'", "j_arm1_"),
    ("observations: [{term: joint_position}]", r":4:.*3 numbers, and the network observes 9", "joint_position 3"),
    ("observations: [{term: joint_position, history: 4}]", r":4:.*12 numbers.*observes 9", "joint_position 12"),
    ("observations: [{term: joint_positon}]", r":4:.*joint_positon", "joint_position"),
    ("observations: [{term: joint_position, scale: [1, 2]}]", r":4:.*3 numbers, and 2 scales", "one for each"),
    ("observations: [{term: joint_position, pick: [3]}]", r":4:.*has no number 3", "from 0 to 2"),
    ("observations: -; file: named.onnx", r":1:.*unknown term 'height_scan'", ""),
    ("default: [0.0, 0.1]", r":3:.*2 numbers of 'default' for 3 joints", "one for each joint"),
    ("default: {j_arm1_1: 0, j_arm1_2: 0}", r":3:.*'default' lacks j_arm1_3", "one number for each joint"),
    ("default: {j_arm1_1: 0, j_arm1_2: 0, j_arm1_4: 0}", r":3:.*unknown joint 'j_arm1_4'", "j_arm1_3"),
    ("default: -", r":1:.*neither the tag `default` nor", "`default`"),
    ("default: -; file: words.onnx", r":1:.*'default_joint_pos' of the file", "finite numbers"),
    ("command_range: {x: [1.0, -1.0]}", r":5:.*begins at 1 and ends at -1", "the smaller one first"),
    ("file: ranges.onnx", r":1:.*'command_ranges' of the file", "lin_vel_x"),
    ("action: {lower: 0.1, upper: 0.0}", r":5:.*bounds of the actions of 'j_arm1_1'", "`lower` below `upper`"),
    (
        "history_order: oldest_step_first; observations: [{term: joint_position, history: 2}, {term: joint_velocity}]",
        r":\d:.*histories of different lengths",
        "one `history`",
    ),
    ("contract: none.yaml", r":5:.*there is no file", "a file"),
    ("action: {scale: [1, 2]}", r":5:.*2 numbers of 'action.scale'", "one for each joint"),
    ("action: {kind: positions}", r":5:.*positions", "position"),
    ("gains: {stiffness: -1.0}", r":5:.*a stiffness of -1", "from zero on"),
    ("rate: 201.0", r":5:.*its network at 201 Hz", "at least as fast"),
    ("file: netwrok.onnx", r":1:.*there is no file", "network.onnx"),
    ("file: text.onnx", r":1:.*'text.onnx' is no network", "an ONNX file"),
    ("file: custom.onnx", r":1:.*Magic", "ONNX's own operators"),
    ("file: large.onnx", r":1:.*more than 200 MB", "a smaller network"),
    ("file: two.onnx", r":1:.*2 inputs beside its states: obs, image", "one input"),
    ("file: open.onnx", r":1:.*'obs' has the shape", "a last size"),
    ("file: whole.onnx", r":1:.*", ""),
    ("file: lies.onnx", r":1:.*", ""),
]


@pytest.mark.parametrize(("content", "message", "expected"), REFUSALS, ids=[row[0] for row in REFUSALS])
def test_refusals_have_their_place(tmp_path, content, message, expected):
    """A mistake of the configuration or the file, and what is refused with its place before anything moves."""
    file = written(tmp_path, content)
    with pytest.raises(SolferError, match=f"policy.yaml{message}") as refused:
        Policy(centauro(), read(file, Policy.Tags)).set_rate(RATE)
    assert expected in str(refused.value)


def test_terms_of_the_base_need_one(tmp_path):
    file, *_ = random_network(tmp_path, 3)
    with pytest.raises(SolferError, match="no floating base"):
        policy(file, robots.upper_body(), observations=terms("angular_velocity"))


def test_a_missing_onnxruntime_names_the_command(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(MissingDependency, match="needs onnxruntime") as missing:
        Policy(centauro(), read(written(tmp_path), Policy.Tags))
    assert "pip install" in missing.value.expected


def is_held(component):
    """Return whether a robot is held where it is, with the gains of before."""
    before = component.steps
    command = cycle(component, 8)
    robot = component.model
    same = np.array_equal(command.position, robot.state.position)
    return same and not command.velocity.any() and component.steps == before


def test_it_does_not_start_far_from_the_default_pose(tmp_path, caplog):
    file, *_ = random_network(tmp_path, 9)
    component = policy(file, start_tolerance=0.05, gains={"stiffness": 10.0})
    assert is_held(component) and not component.model.command["stiffness"].any()
    (record,) = caplog.records
    assert "'j_arm1_2' is +0.500 from" in record.message and record.levelname == "ERROR"
    robot = component.model
    robot.state.position[component.contract.dofs] = DEFAULT
    component.reset()
    component.init()
    assert not component.fault and not is_held(component)


def test_a_fall_and_no_numbers_hold_the_robot_once(tmp_path, caplog):
    written(tmp_path)
    component = policy(tmp_path / "network.onnx")
    assert cycle(component) is not None and not component.fault
    component.model.state.position[3] = 0.9  # about x
    assert is_held(component) and "tilts by 0.90 rad" in component.fault
    component.model.state.position[3] = 0.0
    assert len(caplog.records) == 1
    component = policy(tmp_path / "nan.onnx")
    cycle(component)
    assert is_held(component) and "'j_arm1_1' is not finite" in component.fault and len(caplog.records) == 2


def test_stop_holds(tmp_path):
    file, *_ = random_network(tmp_path, 9)
    component = policy(file, action={"kind": "velocity"})
    assert cycle(component).velocity.any()
    component.stop()
    component.send()
    assert not component.model.command.velocity.any()


def test_torques_are_declared(tmp_path):
    file, *_ = random_network(tmp_path, 9)
    component = policy(file, action={"kind": "torque"})
    assert np.array_equal(component.efforts, component.contract.dofs)
    assert not len(policy(file).efforts)
    assert component.topics() == () and policy(file).topics() == ()


def test_springs_of_the_plugin_are_torques(tmp_path):
    """Torques are those of the springs in each cycle, also between two steps; the lower level's have no stiffness."""
    file, *_ = random_network(tmp_path, 9)
    action = {"springs": "plugin", "scale": 0.1}
    component = policy(file, action=action, gains={"stiffness": (10.0, 20.0, 30.0), "damping": 2.0})
    robot = component.model
    dofs = component.contract.dofs
    assert np.array_equal(component.efforts, dofs)
    for step in range(6):
        moved(robot, step)
        robot.state.position[3:5] = 0.0
        command = cycle(component)
        desired = component.contract.default + 0.1 * component.network.actions
        torque = (10.0, 20.0, 30.0) * (desired - robot.state.position[dofs])
        assert np.abs(command.torque[dofs] - torque).max() < 1e-6
        assert not command["stiffness"][dofs].any() and (command["damping"][dofs] == 2.0).all()
    with pytest.raises(SolferError, match="no stiffness"):
        policy(file, action=action)

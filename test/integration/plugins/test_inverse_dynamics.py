"""Robots on the torques of `inverse_dynamics`: they squat, and their feet keep their grip."""

import contextlib
import shutil

import numpy as np
import pinocchio
import pytest
from support.integration.carried import WRONG, with_other_masses, with_other_trunk
from support.integration.torque_robot import ARMS, FRICTION, LEGGED, Legged, opened
from support.integration.world import CONFIG, World, parameters, perfect
from support.integration.xbot_world import XbotWorld

from solfer.config import load
from solfer.interfaces.task_references import SetReference
from solfer.plugins import PluginState, Registry, generate
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorRules
from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.bundle import load_bundle

WHEELS, GRIP = tuple(f"wheel_{leg}" for leg in range(1, 5)), 0.8
"""Wheels of CENTAURO, and the friction below them."""


class SquatWatch:
    """What a robot does while it squats.

    Args:
        bus: The bus of plugin and simulation.
        plugin: The plugin.
        simulation: The simulation.
    """

    def __init__(self, bus, plugin, simulation):
        self._com, self._simulation = plugin.component.tasks["com"], simulation
        self.errors, self.heights, self.grips, self.torques = [], [], [], []
        bus.every(0.005, self._look)

    def _look(self):
        self.errors.append(self._com.point.value - self._com.reference.value)
        self.heights.append(float(self._com.point.value[2]))
        forces = np.array(list(self._simulation.contacts().values()))
        self.grips.append(float(np.max(np.linalg.norm(forces[:, :2], axis=1) / forces[:, 2])))
        self.torques.append(self._simulation.torque.copy())

    def check(self, friction, way):
        """Check that the centre of mass has followed to within 1 mm RMS, and contacts and torques their limits."""
        assert np.sqrt(np.mean(np.sum(np.square(self.errors), axis=1))) < 0.001
        assert max(self.heights) - min(self.heights) > 0.95 * way
        assert max(self.grips) < friction
        assert (np.abs(self.torques) <= self._simulation.kinematics.effort_limit).all()


def test_centauro_squats_within_friction_and_torques():
    with contextlib.closing(World()) as world:
        world.run(1.0)
        plugin, before = world.plugin("squat"), world.simulation.torque.copy()
        world.run(0.01)
        watch = SquatWatch(world.bus, plugin, world.simulation)
        world.run(3.5)
        watch.check(GRIP, 0.1)
        assert set(world.simulation.contacts()) == set(WHEELS)
        assert plugin.life is PluginState.RUNNING and not plugin.component.is_holding
        # it takes over what springs carried; what friction in the motors held is 6 Nm, as with `soft_compensation`
        assert np.abs(np.diff([before, *watch.torques[:20]], axis=0))[:, 6:].max() < 8.0


SQUATS = {"talos": 0.05, "solo": 0.02, "anymal": 0.05, "hyq": 0.05, "go2": 0.03, "go1": 0.03, "b1": 0.05}
"""Robots, with how far they squat to each side [m]."""


@pytest.mark.slow
@pytest.mark.daily(3)
@pytest.mark.parametrize(("name", "amplitude"), SQUATS.items())
def test_other_robots_squat_by_their_files_alone(name, amplitude, tmp_path):
    with opened(name, tmp_path, amplitude) as robot:
        robot.run(0.5)
        watch = SquatWatch(robot.bus, robot.plugin, robot.simulation)
        robot.run(3.2)
        watch.check(FRICTION, 2.0 * amplitude)
        assert robot.plugin.life is PluginState.RUNNING and not robot.plugin.component.is_holding
        assert len(robot.simulation.contacts()) == len(LEGGED[name].feet)


class SensedWorld(World):
    """CENTAURO with its sensors as they are shipped."""

    is_perfect = False


def test_it_squats_where_odometry_says_that_it_is():
    """The true centre of mass stays within twice the bound of a base that is measured, and pushes shake no joint."""
    with contextlib.closing(SensedWorld()) as world:
        world.run(1.0)
        world.plugin("odometry", target="solfer.components.odometry:Odometry")
        world.run(0.5)
        plugin, errors = world.plugin("squat_estimated"), []
        world.run(0.01)
        com = plugin.component.tasks["com"]
        model, _ = plugin.robot.kinematics.pinocchio
        data = model.createData()

        def look():
            errors.append(pinocchio.centerOfMass(model, data, world.simulation.q) - com.reference.value)

        world.bus.every(0.005, look)
        world.run(3.2)
        assert np.sqrt(np.mean(np.sum(np.square(errors), axis=1))) < 0.01
        joints = [index for index, name in enumerate(world.simulation.kinematics.dofs) if "wheel" not in name][6:]
        world.simulation.pushes.add("pelvis", (85.0, 50.0, 0.0), (0.0, 0.0, 0.0), 0.3)
        world.run(3.0)
        speeds = []
        world.bus.every(0.005, lambda: speeds.append(world.simulation.v[joints].copy()))
        world.run(1.0)
        assert np.std(np.diff(speeds, axis=0), axis=0).max() < 0.02
        assert plugin.life is PluginState.RUNNING and not plugin.component.is_holding


class WrongWorld(World):
    """CENTAURO with masses that are up to 20 % wrong, and a trunk whose centre of mass is 20 mm aside."""

    def offer(self, middleware):
        text = with_other_masses(with_other_trunk(parameters()["/robot_description"], 0.02, seed=1), WRONG, seed=1)
        simulation = Simulation(load_bundle(perfect(), text))
        return simulation, SimulationServer(simulation, middleware)


def test_a_wrong_model_corrects_itself(tmp_path):
    """The true centre of mass, which is 8 mm aside, comes to where its reference is; forces that stop freeze it."""
    for name in ("support", "robots"):
        (tmp_path / name).symlink_to(CONFIG / name)
    file = tmp_path / "centauro.yaml"
    tag = "speed_driven: wheels"
    file.write_text((CONFIG / "centauro.yaml").read_text().replace(tag, f"correct_model: true\n      {tag}", 1))
    with contextlib.closing(WrongWorld()) as world:
        world.run(1.0)
        plugin, errors = world.plugin("squat", file), []
        world.run(3.0)
        correction, com = plugin.component.correction, plugin.component.tasks["com"]
        model = world.simulation.kinematics.pinocchio[0]
        data = model.createData()

        def look():
            errors.append(pinocchio.centerOfMass(model, data, world.simulation.q) - com.reference.value)

        world.bus.every(0.01, look)
        world.run(1.0)
        assert correction.reason == "estimates" and np.linalg.norm(correction.offset[:2]) > 0.006
        assert np.linalg.norm(errors, axis=1).min() > 0.01  # its height is not seen
        assert np.linalg.norm(np.array(errors)[:, :2], axis=1).max() < 0.002
        assert not plugin.component.is_holding


def test_a_layer_squats_at_500_hz(tmp_path):
    """The executor in shared memory keeps the accuracy and the limits that a node keeps."""
    with contextlib.closing(XbotWorld(tmp_path)) as world:
        world.run(1.0)
        node = world.node("squat")
        loaded = load(CONFIG / "centauro.yaml", "squat", middleware="XBOT", layer="RT")
        plugin = generate(loaded, node, Registry().find("inverse_dynamics", loaded.module.class_))
        rules = ExecutorRules(blend=0.1, budget=1.0, overruns=10**9)
        executor = Executor([plugin], world.node("xbot"), EmergencyStopLatch(tmp_path), rules=rules, polls=[node.poll])
        executor.switchboard.commit(executor.switchboard.plan(start=["squat"]))
        world.bus.every(1.0 / executor.rate, executor.cycle)
        world.run(0.5)
        assert executor.rate == 500.0
        watch = SquatWatch(world.bus, plugin, world.simulation)
        world.run(3.0)
        watch.check(GRIP, 0.1)
        assert executor.plugins[0].state is PluginState.RUNNING and not plugin.component.is_holding


def test_offline_it_computes_and_commands_nothing():
    """On what another plugin desires: of the arms, which touch nothing, its torques are those that hold the robot."""
    with contextlib.closing(World()) as world:
        world.run(1.0)
        mover = world.plugin("desired_joints")
        world.run(0.2)
        plugin = world.plugin("squat_offline")
        world.run(0.6)
        assert plugin.life is mover.life is PluginState.RUNNING and not plugin.component.is_holding
        assert not plugin.outputs.commanding
        arms = plugin.robot.selectors["left_arm"].indices
        computed, measured = plugin.component.problem.torque[arms], world.simulation.torque[arms]
        assert np.abs(measured).max() > 2.0 and np.abs(computed - measured).max() < 0.3


@pytest.mark.parametrize("end", ["stop", "kill"])
def test_at_its_end_the_lower_level_holds_the_robot(end):
    """In the middle of a squat: after the lease where the plugin is killed, at once where it stops."""
    with contextlib.closing(World()) as world:
        world.run(0.5)
        plugin, state = world.plugin("squat"), world.simulation
        world.run(1.6)
        before = state.q.copy()
        assert np.abs(state.v[6:]).max() > 0.05
        if end == "stop":
            plugin.stop()
        world.asleep.add("squat")
        world.run(1.5)
        assert np.abs(state.v).max() < 0.02 and np.abs(state.q - before)[3:5].max() < 0.02
        assert abs(state.q[2] - before[2]) < 0.04 and len(state.contacts()) == 4


def lose_effort(world):
    """Let a hip have no torque any more, whatever is commanded."""
    level, dof = world.simulation.lower_level, world.simulation.kinematics.dofs.index("hip_pitch_1")
    update = level.update

    def weak(*state):
        torque, speed = update(*state)
        torque[dof] = 0.0
        return torque, speed

    level.update = weak


def slip(world):
    """Make the ground slippery, and push."""
    world.simulation.world.set_friction("ground", 0.15)
    world.simulation.pushes.add("pelvis", (0.0, 250.0, 0.0), (0.0, 0.0, 0.0), 1.0)


def lift(world):
    """Let a contact of the list measure no force, as one above a hole."""
    plugin = world.squatting
    read = plugin.component.update

    def update():
        plugin.robot.contacts["front_left_leg"].wrench[:] = 0.0
        read()

    plugin.component.update = update


def stretch(world):
    """Let the centre of mass rise higher than the legs reach."""
    world.squatting.component.references.interface.set_reference(SetReference("com", (0.0, 0.0, 0.3), relative=True))


@pytest.mark.daily(2)
@pytest.mark.parametrize(
    ("fault", "text"),
    [
        (lose_effort, "joint 'hip_pitch_1' has a torque of"),
        (slip, "slips: it has moved by"),
        (lift, "contact 'front_left_leg' touches nothing, and is to carry"),
        (stretch, "the QP has no solution: "),
    ],
)
def test_a_fault_is_named_and_the_robot_held(fault, text, caplog):
    """The robot holds within its torque limits instead of falling, and the log has the reason."""
    with contextlib.closing(World()) as world:
        world.run(0.5)
        world.squatting = world.plugin("inverse_dynamics")
        world.run(3.2)
        assert not world.squatting.component.is_holding
        torques, heights = [], []
        world.bus.every(0.005, lambda: torques.append(world.simulation.torque.copy()))
        world.bus.every(0.005, lambda: heights.append(world.simulation.q[2]))
        fault(world)
        world.run(2.0)
        assert text in caplog.text
        assert world.squatting.life is PluginState.RUNNING and min(heights) > heights[0] - 0.15
        if fault is not stretch:  # there the stops of joints take more than their drives
            assert (np.abs(torques) <= world.simulation.kinematics.effort_limit).all()
            assert world.squatting.component.is_holding and np.abs(world.simulation.v).max() < 0.05


class Circle:
    """How far a tip is from the circle that it draws, and torques from those of Pinocchio.

    Args:
        bus: The bus of plugin and simulation.
        plugin: The plugin, with a task `tip` whose point and reference have the same axes.
    """

    def __init__(self, bus, plugin):
        self._plugin = plugin
        self._model, _ = plugin.robot.kinematics.pinocchio
        self._data = self._model.createData()
        self.ways, self.errors, self.differences = [], [], []
        bus.every(0.005, self._look)

    def _look(self):
        component, robot = self._plugin.component, self._plugin.robot
        tip = component.tasks["tip"]
        self.ways.append(tip.point.value[:3].copy())
        self.errors.append(np.linalg.norm(tip.point.value - tip.reference.value))
        state, problem = robot.state, component.problem
        followers, acceleration = robot.kinematics.followers, problem.acceleration.copy()
        acceleration[followers.dofs] = followers.ratios * acceleration[followers.leaders]
        torque = followers.fold(pinocchio.rnea(self._model, self._data, state.position, state.velocity, acceleration))
        torque -= component.ground.jacobian.T @ problem.force
        driven = np.setdiff1d(robot.actuated, followers.dofs)
        self.differences.append(np.abs(torque - problem.torque)[driven].max())

    def check(self):
        """Check that the tip has gone around, within 2 mm, by the torques of Pinocchio."""
        assert np.ptp(self.ways, axis=0).max() > 0.09
        assert np.max(self.errors) < 0.002
        assert np.max(self.differences) < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
def test_an_arm_needs_no_contact(name, tmp_path):
    with opened(name, tmp_path, 0.0) as robot:
        robot.run(0.5)
        circle = Circle(robot.bus, robot.plugin)
        robot.run(3.0)
        circle.check()
        assert robot.plugin.life is PluginState.RUNNING and not robot.plugin.component.is_holding


UPPER_BODY = """
    upper_squat:
      <<: *torques
      secondary_file: {file: support/upper_torques.yaml}
      robot: simulated
      controller: [position_controller]
      track: all
      speed_driven:
      stack:
        tasks:
          tip: {point: position, link: arm1_7, gain: 4, reference: {circle: {radius: 0.05, period: 4.0, plane: yz}}}
          posture: {point: posture, gain: 5}
        levels: [[tip], [posture]]
"""
PART = """mwoibn:
  ros: {source: {urdf: /robot_upper_body}}
  feedbacks: {simulated: [link_side_online]}
  controller: {position_controller: {interface: {velocity: true, stiffness: true, damping: true}}}
"""


def cart():
    """Write a cart of 30 kg on four wheels with an arm of four joints, and its groups; return URDF and SRDF."""
    joint = (
        '<joint name="{0}" type="{1}"><origin xyz="{2}"/><parent link="{3}"/><child link="{0}"/><axis xyz="{4}"/>'
        '<limit lower="-3" upper="3" effort="{5}" velocity="5"/></joint><link name="{0}"><inertial>'
        '<origin xyz="{6}"/><mass value="{7}"/><inertia ixx="{8}" iyy="{8}" izz="{8}" ixy="0" ixz="0" iyz="0"/>'
        "</inertial>{9}</link>"
    )
    body = (
        '<link name="base_link"><inertial><mass value="30"/><inertia ixx="1" iyy="1" izz="1.5" ixy="0" ixz="0" '
        'iyz="0"/></inertial></link>'
    )
    ball = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    sides = {"front_left": "0.3 0.25", "front_right": "0.3 -0.25", "rear_left": "-0.3 0.25", "rear_right": "-0.3 -0.25"}
    parts = [
        joint.format(f"{name}_wheel", "continuous", f"{place} -0.1", "base_link", "0 1 0", 20, "0 0 0", 1, 0.005, ball)
        for name, place in sides.items()
    ]
    parents, axes = ("base_link", "turn", "shoulder", "elbow"), ("0 0 1", "0 1 0", "0 1 0", "0 1 0")
    parts += [
        joint.format(name, "revolute", "0 0 0.3", parent, axis, 80, "0 0 0.15", 2, 0.02, "")
        for name, parent, axis in zip(("turn", "shoulder", "elbow", "wrist"), parents, axes, strict=True)
    ]
    links = "".join(f'<link name="{name}_wheel"/>' for name in sides)
    wheels = "".join(f'<joint name="{name}_wheel"/>' for name in sides)
    bend = {"shoulder": 0.4, "elbow": 1.8, "wrist": -0.6}
    state = "".join(f'<joint name="{name}" value="{value}"/>' for name, value in bend.items())
    arm = "".join(f'<joint name="{name}"/>' for name in ("turn", *bend))
    groups = f'<group name="wheels">{links}{wheels}</group><group name="arm">{arm}</group>'
    return (
        f'<robot name="cart">{body}{"".join(parts)}</robot>',
        f'<robot name="cart">{groups}<group_state name="bent" group="arm">{state}</group_state></robot>',
    )


@pytest.mark.slow
def test_an_arm_on_a_cart_draws_a_circle(tmp_path, monkeypatch):
    """The cart stands on its wheels, whose drives hold them against the reaction of the arm."""
    files = tmp_path / "cart.urdf", tmp_path / "cart.srdf"
    for file, text in zip(files, cart(), strict=True):
        file.write_text(text)
    feet = tuple(f"{each}_wheel" for each in ("front_left", "front_right", "rear_left", "rear_right"))
    axis = dict(zip("xyz", (0, 1, 0), strict=True))
    wheel = {"type": "wheel", "minor_axis": 0.1, "major_axis": 0.0, "reference_axis": axis}
    tags = {"speed_driven": "wheels", "gains": [{"chain": "arm", "stiffness": 0}]}
    robot = Legged(*map(str, files), "bent", feet, 3, contact=wheel, tags=tags, tip="wrist")
    monkeypatch.setitem(LEGGED, "cart", robot)
    with opened("cart", tmp_path, 0.0) as scene:
        scene.run(0.5)
        circle = Circle(scene.bus, scene.plugin)
        scene.run(3.0)
        assert scene.plugin.life is PluginState.RUNNING and not scene.plugin.component.is_holding
        circle.check()


def more(folder, plugins):
    """Write the shipped configuration with more plugins into a folder; return its file."""
    for name in ("robots", "references"):
        (folder / name).symlink_to(CONFIG / name)
    shutil.copytree(CONFIG / "support", folder / "support")
    (folder / "support/upper_torques.yaml").write_text(PART)
    file, text = folder / "centauro.yaml", (CONFIG / "centauro.yaml").read_text()
    file.write_text(text.replace("\n    squat_estimated:", f"{plugins}\n    squat_estimated:", 1))
    return file


def test_hands_in_the_air_hold_nothing(tmp_path):
    """The contacts of both hands are in the robot's file; by the measured torques they bear nothing."""
    file = more(tmp_path, UPPER_BODY)
    with contextlib.closing(World()) as world:
        world.run(1.0)
        plugin = world.plugin("upper_squat", file, target="solfer.components.inverse_dynamics:InverseDynamics")
        world.run(0.5)
        assert plugin.component.ground.names == ("left_arm", "right_arm")
        assert not plugin.component.ground.fractions.any()
        circle = Circle(world.bus, plugin)
        world.run(3.0)
        circle.check()
        assert plugin.life is PluginState.RUNNING and not plugin.component.is_holding


def test_all_contacts_of_the_whole_robot_may_be_tracked(tmp_path):
    with contextlib.closing(World()) as world:
        world.run(1.0)
        file = more(tmp_path, "\n    whole: {<<: *squat, track: all}")
        plugin = world.plugin("whole", file, target="solfer.components.inverse_dynamics:InverseDynamics")
        world.run(0.01)
        watch = SquatWatch(world.bus, plugin, world.simulation)
        world.run(3.5)
        watch.check(GRIP, 0.1)
        ground = plugin.component.ground
        legs = {f"{side}_leg" for side in ("front_left", "front_right", "rear_left", "rear_right")}
        assert {name for name, ratio in zip(ground.names, ground.fractions, strict=True) if ratio.any()} == legs
        assert set(ground.names) == legs | {"left_arm", "right_arm"}
        assert plugin.life is PluginState.RUNNING and not plugin.component.is_holding

"""Fig. 5 of the paper, whole: `full_control` and `hands` of the shipped configuration drive CENTAURO in PyBullet."""

from contextlib import closing

import numpy as np
import pytest
from support.paper.full_control import PERIOD, Figure5Layer, Nodes, course
from support.plugins.plugin_claims import kill, owners

from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import CycleTrace, PluginState
from solfer.transport.messages import FieldsMessage
from solfer_tools.scenarios import read_scenario

CYCLE = [
    "hands reads link_side_online",
    "hands publishes upper_body",
    "odometry reads link_side_online",
    "odometry reads imu_base",
    "odometry computes kinematics because of link_side_online, imu_base",
    "odometry writes",
    "odometry publishes odometry",
    "odometry publishes odom",
    "ground_forces reads link_side_online",
    "ground_forces reads odometry",
    "ground_forces computes kinematics because of link_side_online, odometry",
    "ground_forces computes bias because of link_side_online, odometry",
    "ground_forces computes inertia because of link_side_online, odometry",
    "ground_forces computes contacts because of link_side_online, odometry",
    "ground_forces computes center_of_pressure because of link_side_online, odometry",
    "ground_forces publishes ground_forces",
    "ground_forces publishes center_of_pressure",
    "locomotion computes kinematics because of odometry",
    "locomotion computes contacts because of link_side_online, imu_base, odometry",
    "locomotion reads ground_forces",
    "locomotion publishes lower_body",
    "full_compensation reads manipulation",
    "full_compensation reads lower_body",
    "full_compensation publishes position_controller",
    "full_compensation publishes velocity_controller",
]
"""What section 2.3 of the paper says of an update, in its order: kinematics of the legs, the estimate that is written
there, kinematics and dynamics of the whole robot, kinematics of the legs anew, and nothing of the whole robot any more.
A measurement of the joints waits for the sample of the IMU after it: a cycle may have none, and the next one two of
them. At 500 Hz most cycles have none, and their first kinematics are missing."""

COURSE = """
base now: [0.0, 0.0, 0.0, 0.0]
base_const_vel: [0.0, 0.0, 0.0, 0.0]
vel: 0.02
dt: 0.01
x cp: [0.0, 0.0, 0.0, 0.0]
y cp: [0.0, 0.0, 0.0, 0.0]
z cp: [0.0, 0.0, 0.0, 0.0]
x cp ref: [[0.0, 0.0, 0.0, 0.0]]
y cp ref: [[0.0, 0.0, 0.0, 0.0], [-0.03, 0.03, -0.03, 0.03]]
z cp ref: [[0.0, 0.0, 0.0, 0.0]]
base ref: [[0.0, 0.0, 0.0, 0.0], [0.3, 0.0, 0.0, 0.0]]
pattern:
  1: {type: speed, motions: [[3, 0, 0.15]]}
  2: {type: wait, steps: 200}
  3: {type: move, x_cp: 0, y_cp: 1, z_cp: 0, base: 1}
  4: {type: wait, steps: 150}
"""


KINDS = [pytest.param(Nodes, id="nodes"), pytest.param(Figure5Layer, id="layer", marks=pytest.mark.soak)]


@pytest.fixture(scope="module", params=KINDS)
def world(request, tmp_path_factory):
    with closing(request.param(tmp_path_factory.mktemp("layer"))) as world:
        world.run(2.5)
        yield world


def test_a_cycle_is_the_papers(world):
    """Plugins that share a robot share its kinematics and dynamics.

    Each quantity is computed only as often as needed.
    """
    robots = {"L": ("odometry", "locomotion"), "W": ("ground_forces", "full_compensation")}
    kinematics = {each: {id(world.plugins[name].robot.kinematics) for name in names} for each, names in robots.items()}
    assert [len(each) for each in kinematics.values()] == [1, 1] and kinematics["L"] != kinematics["W"]
    robot = {each: world.plugins[names[0]].robot for each, names in robots.items()}
    assert not robot["L"].is_whole and robot["W"].is_whole
    before = {each: dict(robot[each].computations()) for each in robots}
    trace = CycleTrace(list(world.plugins.values()))
    world.run(20.0 / world.rate)
    trace.close()
    assert CYCLE in [trace.of(cycle) for cycle in range(1, 20)]
    counts = {
        each: {what: count - before[each].get(what, 0) for what, count in robot[each].computations().items()}
        for each in robots
    }
    assert counts["W"]["kinematics"] == 20
    measured = 20 if world.rate == 200.0 else 8
    assert counts["L"]["kinematics"] == pytest.approx(20 + measured, abs=1)
    assert counts["W"]["bias"] == 20 and not counts["L"].get("bias")
    assert counts["W"]["inertia"] == 20  # the IMU moves the base in each cycle


def test_it_drives_while_the_hands_wave(world, tmp_path):
    """Base, footprint, hands and centre of mass keep to their references in millimetres.

    The footprint changes its width meanwhile, and no output is refused.
    """
    file = tmp_path / "course.yaml"
    file.write_text(COURSE)
    references, now = world.plugins["locomotion"].component.references, world.simulation.state.now
    begin, center, footprint = world.center_of_legs(), world.center_of_mass(), world.footprint()
    rows = []

    def look(waving):
        base = world.center_of_legs() - references.position
        base[2] = now.position("pelvis")[2] - references.position[2]
        vertices = world.footprint() - references.vertices[:, :2]
        hands = [place - waving.desired[name] for name, place in world.hands().items()]
        rows.append((base, vertices, hands, world.center_of_mass() - center, waving.desired["left"].copy()))

    world.play(read_scenario(file), look)
    base, vertices, hands, away, desired = (np.array(each) for each in zip(*rows, strict=True))
    assert np.ptp(desired, axis=0)[2] > 0.25  # they wave
    assert world.center_of_legs()[0] - begin[0] == pytest.approx(0.2955, abs=0.003)  # as the file, 1 % of its way
    assert (np.abs(world.footprint() - footprint)[:, 1] > 0.01).all()
    assert np.linalg.norm(base, axis=1).max() < 4e-3
    assert np.linalg.norm(vertices, axis=2).max() < 5e-3
    assert np.linalg.norm(hands, axis=2).max() < 8e-3
    assert np.abs(away).max() < 0.03  # arms weigh a tenth of the robot
    assert not any(count for plugin in world.plugins.values() for count in plugin.outputs.counts().values())
    assert {plugin.life for plugin in world.plugins.values()} == {PluginState.RUNNING}


SENT = ["locomotion reads ground_forces", "locomotion reads base", "locomotion reads vertices"]
"""What the locomotion of Fig. 5 receives, in its order, in cycles in which navigation has sent positions."""


def test_navigation_sends_positions_of_base_and_vertices(world, tmp_path):
    """A POINT of the base and POINTS of four vertices come together, in each period of the navigation."""
    file = tmp_path / "course.yaml"
    file.write_text(course(0.02, 0.0, 0.1, 0.1))
    locomotion = world.plugins["locomotion"].component
    assert locomotion.inputs["base"].value.shape == (7,) and locomotion.inputs["vertices"].value.shape == (4, 3)
    trace = CycleTrace(list(world.plugins.values()))
    world.play(read_scenario(file), lambda _: None)
    trace.close()
    received = [[each for each in trace.of(cycle) if each in SENT] for cycle in range(1, trace.cycle)]
    sent = [index for index, cycle in enumerate(received) if cycle == SENT]
    assert all(cycle in (SENT, SENT[:1]) for cycle in received)
    assert len(sent) > 50 and np.diff(sent).mean() == pytest.approx(PERIOD * world.rate)


@pytest.mark.daily(1)
@pytest.mark.parametrize("world", [Nodes], ids=["nodes"], indirect=True)
@pytest.mark.parametrize("drives", [True, False])
def test_a_compensation_that_dies_and_comes_back_does_not_let_the_base_sink(world, drives):
    """Torques and targets stay when nothing arrives; the same process, continued, carries the robot from there."""
    plugin = world.plugins["full_compensation"]
    heights = []
    if drives:
        writer = MemoryMiddleware(world.bus, "driver").writer("locomotion/wheels_state", "solfer/WheelsState")
        for _ in range(50):
            writer.write(FieldsMessage({"x": 0.05, "y": 0.0, "z": 0.0, "rz": 0.0, "cs": (), "cm": ()}))
            world.run(0.02)
        assert world.simulation.v[0] > 0.03
    height = world.simulation.q[2]
    world.bus.every(0.001, lambda: heights.append(world.simulation.q[2] - height))
    kill(plugin)
    world.run(2.0)
    assert not any(owners(world).values())
    plugin.life = PluginState.RUNNING
    world.run(4.0)
    assert {each.life for each in world.plugins.values()} == {PluginState.RUNNING}
    assert len(heights) > 5900 and np.abs(heights).max() < 5e-3

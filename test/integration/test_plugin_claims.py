"""Who commands the simulated CENTAURO: a second claimant, one that dies, and wrong commands, on the virtual clock."""

import numpy as np
import pytest
from test_plugin import WHEELS
from world import STEP

from solfer.errors import ClaimRefused
from solfer.middleware.memory import MemoryMiddleware
from solfer.pipes import JointMessage
from solfer.plugins import Life

SECONDS = 3.0  # until a robot whose wheels have stopped stands still


def dofs(world, names=WHEELS):
    """DoFs of the model."""
    return [world.simulation.kinematics.dofs.index(name) for name in names]


def command(world, sender, controller, names, **fields):
    """Publish one command."""
    writer = MemoryMiddleware(world.bus, sender).writer(f"{controller}/command", "solfer/JointCommand")
    writer.write(JointMessage(names, **{name: np.asarray(values, dtype=float) for name, values in fields.items()}))


def drive(world, speed=2.0):
    """The plugin `joint_states` turns the wheels."""
    plugin = world.plugin("joint_states")
    world.run(0.5)
    assert world.ask(joints=WHEELS, velocities=(speed,) * 4).success
    world.run(1.5)
    assert np.abs(world.simulation.v[dofs(world)] - speed).max() < 0.05
    return plugin


def kill(plugin):
    """End a plugin as `kill -9` would: from one moment on it does nothing, and says goodbye to nobody."""
    plugin.life = Life.CLOSED


def owners(world):
    """Who commands each controller."""
    told = world.ask("lower_level/list_controllers")
    return dict(zip(told.names, told.claimed_by, strict=True))


def test_a_plugin_claims_before_it_starts_and_releases_when_it_stops(world):
    plugin = world.plugin("joint_states")
    assert owners(world) == {"position_controller": "", "velocity_controller": ""}
    world.run(0.1)
    assert plugin.life is Life.RUNNING
    assert all(told.startswith("joint_states: ") for told in owners(world).values())
    plugin.stop()
    world.run(2 * STEP)
    assert set(owners(world).values()) == {""}


def test_a_second_plugin_on_the_same_joints_is_refused_and_the_first_goes_on(world):
    first = drive(world)
    second = world.plugin("joint_lower")
    with pytest.raises(ClaimRefused) as refusal:
        world.run(1.0)
    for name in ("'joint_lower'", "'joint_states'", "hip_yaw_1"):
        assert name in str(refusal.value)
    assert refusal.value.exit_code == 2 and second.life is Life.WAITING
    second.stop()
    second.close()
    refused = world.simulation.lower_level.refused
    world.run(1.0)
    assert first.life is Life.RUNNING and world.simulation.lower_level.refused == refused == 0
    assert np.abs(world.simulation.v[dofs(world)] - 2.0).max() < 0.05


def test_a_publisher_takes_what_is_free_and_nothing_else(world):
    plugin = world.plugin("joint_lower")
    world.run(0.3)
    for _ in range(100):
        command(world, "publisher", "position_controller", ("neck_yaw",), position=[0.2])
        command(world, "publisher", "velocity_controller", WHEELS, velocity=[3.0] * 4)
        world.run(0.01)
    assert world.simulation.q[dofs(world, ["neck_yaw"])[0]] == pytest.approx(0.2, abs=0.01)
    assert np.abs(world.simulation.v[dofs(world)]).max() < 0.05
    assert world.simulation.lower_level.refusals == {"publisher": 100}
    told = owners(world)["position_controller"]
    assert plugin.life is Life.RUNNING and "joint_lower: " in told and "publisher: position" in told


def test_a_killed_claimant_leaves_joints_free_and_the_robot_at_rest(world):
    plugin = drive(world)
    kill(plugin)
    world.run(0.3)
    assert set(owners(world).values()) == {""}  # within 0.32 s
    wheels = dofs(world)
    world.run(SECONDS)
    before, joints = world.simulation.base_message().position.copy(), world.simulation.q[6:].copy()
    assert np.abs(world.simulation.v[wheels]).max() < 0.02
    world.run(2.0)
    assert np.abs(world.simulation.base_message().position - before).max() < 1e-3
    assert np.abs(world.simulation.q[6:] - joints).max() < 2e-3
    command(world, "other", "velocity_controller", WHEELS, velocity=[0.5] * 4)
    world.run(0.01)
    assert owners(world)["velocity_controller"] == "other: velocity"


@pytest.mark.parametrize(("names", "fields"), [
    (("torso_yaw",), {"position": [np.nan]}),
    (("torso_yaw", "neck_yaw"), {"position": [0.1, np.inf]}),
    (("torso_yaw", "torso_jaw"), {"position": [0.1, 0.1]}),
    (("torso_yaw", "torso_yaw"), {"position": [0.1, 0.1]}),
    (("torso_yaw",), {"position": [0.1, 0.2]}),
    (("torso_yaw",), {"stiffness": [1e300]}),
    (("torso_yaw",), {"position": [0.1], "damping": [-1.0]}),
])
def test_a_wrong_command_moves_nothing(world, names, fields):
    world.run(2.0)
    before = world.simulation.q.copy()
    for _ in range(20):
        command(world, "hostile", "position_controller", names, **fields)
        world.run(0.01)
    assert world.simulation.lower_level.refusals == {"hostile": 20}
    assert np.abs(world.simulation.q - before).max() < 5e-4


def test_a_jump_of_a_radian_is_never_faster_than_the_joint_may(world):
    yaw = dofs(world, ["torso_yaw"])[0]
    controller = world.simulation.lower_level.controllers["position_controller"]
    place = controller.joints.index("torso_yaw")
    limit = world.simulation.kinematics.velocity_limit[yaw]
    world.run(0.5)
    command(world, "jumper", "position_controller", ("torso_yaw",), position=[1.0])
    targets, speeds = [], []

    def note():
        targets.append(controller.target[place])
        speeds.append(world.simulation.v[yaw])

    world.bus.every(STEP, note, start=world.bus.time + STEP / 2.0)
    world.run(1.5)
    assert np.abs(np.diff(targets)).max() <= limit * STEP * (1.0 + 1e-9)
    assert np.abs(speeds).max() < 1.25 * limit
    assert world.simulation.q[yaw] == pytest.approx(1.0, abs=0.02)

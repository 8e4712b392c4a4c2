"""What several tests of plugin claims share."""

import numpy as np
from support.plugins.plugin import WHEELS

from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState
from solfer.transport import JointMessage


def dofs(world, names=WHEELS):
    """Return DoFs of the model."""
    return [world.simulation.kinematics.dofs.index(name) for name in names]


def command(world, sender, controller, names, **fields):
    """Publish one command."""
    writer = MemoryMiddleware(world.bus, sender).writer(f"{controller}/command", "solfer/JointCommand")
    writer.write(JointMessage(names, **{name: np.asarray(values, dtype=float) for name, values in fields.items()}))


def drive(world, speed=2.0):
    """Let the plugin `joint_states` turn the wheels."""
    plugin = world.plugin("joint_states")
    world.run(0.5)
    assert world.ask(joints=WHEELS, velocities=(speed,) * 4).success
    world.run(1.5)
    assert np.abs(world.simulation.v[dofs(world)] - speed).max() < 0.05
    return plugin


def kill(plugin):
    """End a plugin as `kill -9` would: from one moment on it does nothing, and unregisters nowhere."""
    plugin.life = PluginState.CLOSED


def owners(world):
    """Return the owners of each controller."""
    published = world.ask("lower_level/list_controllers")
    return dict(zip(published.names, published.claimed_by, strict=True))

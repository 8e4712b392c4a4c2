"""CENTAURO in PyBullet lifts a wheel with the shipped configuration `driving`, as a user asks for it."""

from contextlib import closing

import numpy as np
import pytest
from support.integration.world import World

WHEELS = tuple(f"wheel_{leg}" for leg in (1, 2, 3, 4))
LONGEST = 60.0  # [s]


def ask(world, lifted):
    """Call the service, and wait for its answer."""
    reply = world.bus.call("driving/lift", contacts=["front_left_leg"], lifted=lifted)
    begun = world.bus.time
    while not reply.done():
        world.run(0.1)
        assert world.bus.time < begun + LONGEST
    return reply.result()


@pytest.mark.soak
def test_a_wheel_is_lifted_and_put_down():
    """PyBullet's contacts show the wheel in the air and back on the ground; the pelvis stays level and in place."""
    with closing(World()) as world:
        world.run(1.0)
        world.plugin("odometry", target="solfer.components.odometry:Odometry")
        world.run(0.5)
        driver = world.plugin("driving")
        world.run(1.0)
        now, references = world.simulation.state.now, driver.component.references
        place, height = now.position("pelvis").copy(), now.position("wheel_1")[2]
        answer = ask(world, True)
        assert answer.success, answer.message
        references.vertex_velocity[0, 2] = 0.05
        world.run(0.6)
        references.vertex_velocity[0, 2] = 0.0
        world.run(0.5)
        # the wheel across from it carries little
        assert now.position("wheel_1")[2] > height + 0.02 and "wheel_1" not in world.simulation.contact_links()
        assert now.rotation("pelvis")[2, 2] > 0.999
        assert ask(world, False).success
        world.run(1.0)
        assert abs(now.position("wheel_1")[2] - height) < 4e-3  # without forces it does not feel the ground
        assert set(world.simulation.contact_links()) <= set(WHEELS)
        np.testing.assert_allclose(now.position("pelvis"), place, atol=0.02)  # as exactly as odometry estimates it

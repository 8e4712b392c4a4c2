"""The scene of a simulated robot that squats, at 20 instants against what the simulation does."""

import contextlib

import numpy as np
from numpy.testing import assert_allclose
from support.integration.world import ROBOT, World

from solfer import Robot
from solfer.middleware.memory import MemoryMiddleware
from solfer_tools.scene import LiveScene


def test_the_scene_is_what_the_simulation_does():
    """Links, centre of mass and forces are the true ones; task and commands are those of the plugin."""
    robot = Robot.load(ROBOT / "centauro.urdf", ROBOT / "centauro.srdf", contacts=ROBOT / "contacts.yaml")
    links = {record.name: record.end_frame for record in robot.contact_records}
    with contextlib.closing(World()) as world:
        scene = LiveScene(robot, MemoryMiddleware(world.bus, "scene"))
        world.run(0.997)  # the newest step is a measurement, now and after each 5 ms
        plugin = world.plugin("squat")
        world.run(1.5)
        scene.update()  # finds the topics
        heights = []
        for _ in range(20):
            world.run(0.05)
            state, truth = scene.update(), world.simulation
            for link in ("pelvis", "arm1_7", "wheel_3"):
                assert_allclose(state.measured[link].position, truth.state.now.position(link), atol=1e-6)
                assert_allclose(state.measured[link].rotation, truth.state.now.rotation(link), atol=1e-6)
            carried = truth.contacts()
            for force in state.forces:
                link = links[force.contact]
                # measured in the axes of the link before the newest step
                turned = truth.state.now.rotation(link) @ truth.state.before.rotation(link).T
                assert_allclose(force.force, turned @ carried.get(link, np.zeros(3)), atol=1e-6)
                assert force.touches == (link in carried)
            assert len(state.polygon) == 4 and state.inner.shape == (0, 3)
            com, base = state.references
            assert (com.module, com.task, base.task) == ("squat", "com", "base")
            task = plugin.component.tasks["com"]
            assert_allclose(com.reference.position, task.reference.value, atol=0.01)  # of up to 50 ms ago
            assert np.linalg.norm(com.reference.position - state.center) < 0.02
            heights.append(state.center[2])
        assert max(heights) - min(heights) > 0.04

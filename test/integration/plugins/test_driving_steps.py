"""CENTAURO steps onto a block with the shipped configuration `stepping`, in both engines."""

from contextlib import closing

import numpy as np
import pytest
from support.integration.world import World, perfect

from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.world.records import ENGINES

HEIGHT = 0.1  # of the block [m]


class BlockWorld(World):
    """CENTAURO with a block between the wheels of its left side."""

    def __init__(self, folder, engine):
        self._file = folder / "block.yaml"
        self._file.write_text(
            f"boxes: {{block: {{size: [0.6, 0.5, {HEIGHT}], position: [-0.12, 0.32, {HEIGHT / 2}]}}}}"
        )
        self._engine = engine
        super().__init__()

    def offer(self, middleware):
        simulation = Simulation.from_file(perfect(), world=self._file, engine=self._engine)
        return simulation, SimulationServer(simulation, middleware)

    def step(self, **request):
        """Call the service, and wait for its answer."""
        reply = self.bus.call("stepping/step", contact="rear_left_leg", left=0.0, clearance=0.015, **request)
        while not reply.done():
            self.run(0.1)
            assert self.bus.time < 60.0
        return reply.result()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_wheel_steps_onto_a_block_and_down_again(tmp_path, engine):
    """All wheels carry the robot then, none slips, and odometry knows where the base is."""
    with closing(BlockWorld(tmp_path, engine)) as world:
        now = world.simulation.state.now
        world.run(0.5)
        for name, target in (("odometry", "odometry:Odometry"), ("ground_forces", "ground_forces:GroundForces")):
            world.plugin(name, target=f"solfer.components.{target}")
            world.run(0.5)
        driver = world.plugin("stepping", target="solfer.components.wheeled_motion:WheeledMotion")
        world.run(0.5)
        before = np.array([now.position(f"wheel_{leg}") for leg in (1, 2, 3, 4)])
        for ahead, up in ((0.22, HEIGHT), (-0.22, -HEIGHT)):
            answer = world.step(ahead=ahead, up=up)
            assert answer.success, answer.message
            world.run(1.0)
            wheels = np.array([now.position(f"wheel_{leg}") for leg in (1, 2, 3, 4)])
            moved = wheels - before
            moved[2] -= (max(ahead, 0.0), 0.0, max(up, 0.0))
            assert abs(moved[:, :2]).max() < 0.03 and abs(moved[:, 2]).max() < 3e-3
            forces = driver.component.wheels.measure_forces()
            assert forces.min() > 0.5 * forces.mean()
            error = driver.component.model.state.position[:2] - now.position("pelvis")[:2]
            assert abs(error).max() < 0.015
            assert now.rotation("pelvis")[2, 2] > 0.9999

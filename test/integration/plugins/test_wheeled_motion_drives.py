"""CENTAURO in PyBullet, driven by `cmd_vel`, with the shipped configurations; longer: benchmark/driving.py."""

import math
from contextlib import closing

import numpy as np
import pytest
from support.integration.world import CONFIG, World, perfect

from solfer.middleware.memory import MemoryMiddleware
from solfer.simulation import Simulation, SimulationServer
from solfer.transport.messages import FieldsMessage

SPEED, TURN = 0.2, 0.3  # [m/s], [rad/s]


class DrivenWorld(World):
    """A `World` whose robot receives where to go."""

    def __init__(self):
        super().__init__()
        self.run(1.0)
        self.odometry = self.plugin("odometry", target="solfer.components.odometry:Odometry")
        self.run(0.5)
        self.driver = self.plugin("wheeled_motion")
        self.run(1.0)
        driver = MemoryMiddleware(self.bus, "driver")
        self._velocity = driver.writer("wheeled_motion/cmd_vel", "geometry_msgs/Twist")

    def drive(self, duration: float, x: float = 0.0, y: float = 0.0, turn: float = 0.0) -> None:
        """Send a velocity at 20 Hz for a time [s], then let it come to rest."""
        fields = {"linear": {"x": x, "y": y, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": turn}}
        for _ in range(round(duration / 0.05)):
            self._velocity.write(FieldsMessage(fields))
            self.run(0.05)
        self.run(1.7)

    def pose(self) -> np.ndarray:
        """Return place and heading of the pelvis, shape (4,) [m, rad]."""
        now = self.simulation.state.now
        rotation = now.rotation("pelvis")
        return np.append(now.position("pelvis"), math.atan2(rotation[1, 0], rotation[0, 0]))

    def footprint(self) -> np.ndarray:
        """Return the wheels as seen from the pelvis, shape (4, 2) [m]."""
        now = self.simulation.state.now
        turn, pelvis = now.rotation("pelvis"), now.position("pelvis")
        return np.array([(now.position(f"wheel_{leg}") - pelvis) @ turn for leg in (1, 2, 3, 4)])[:, :2]


class SlopedWorld(DrivenWorld):
    """The same on a slope of 5 degrees."""

    def offer(self, middleware):
        simulation = Simulation.from_file(perfect(), world=CONFIG / "worlds" / "slope.yaml")
        return simulation, SimulationServer(simulation, middleware)

    def height(self) -> float:
        """Return the height of the pelvis over its wheels [m]."""
        now = self.simulation.state.now
        return now.position("pelvis")[2] - np.mean([now.position(f"wheel_{leg}")[2] for leg in (1, 2, 3, 4)])


@pytest.fixture(scope="module")
def driven():
    with closing(DrivenWorld()) as world:
        yield world


@pytest.mark.daily(1)
@pytest.mark.parametrize(
    "motion", [{"x": SPEED}, {"turn": TURN}, {"y": -SPEED}], ids=["forward", "turn on the spot", "sideways"]
)
def test_it_goes_where_it_is_driven(driven, motion):
    before, standing, position = driven.pose(), driven.footprint(), driven.driver.component.references.position.copy()
    heading = driven.driver.component.references.heading
    driven.drive(1.0, **motion)
    way, references = driven.pose() - before, driven.driver.component.references
    desired = references.position - position
    np.testing.assert_allclose(way[:2], desired[:2], atol=5e-3)
    assert abs(way[3] - (references.heading - heading)) < 5e-3 and abs(way[2]) < 5e-3
    gone = max(np.linalg.norm(desired[:2]), abs(references.heading - heading))
    assert gone > 0.15  # a part of the time goes into turning the wheels
    assert np.linalg.norm(driven.footprint() - standing, axis=1).max() < 8e-3
    assert set(driven.simulation.contact_links()) == {f"wheel_{leg}" for leg in (1, 2, 3, 4)}
    assert not any(driven.driver.outputs.counts().values())  # the gate had nothing to do


def test_the_base_rises_with_a_slope():
    with closing(SlopedWorld()) as world:
        before, height = world.pose(), world.height()
        world.drive(3.0, x=SPEED)
        way = world.pose() - before
        assert way[0] > 0.5 and way[2] == pytest.approx(way[0] * math.tan(math.radians(5.0)), abs=0.015)
        assert world.height() == pytest.approx(height, abs=0.015)  # less than the rise
        assert world.driver.component.references.rise > 0.03


@pytest.mark.soak
def test_it_rests_where_nothing_is_sent(driven):
    driven.run(2.0)
    robot, before = driven.driver.robot, driven.pose()
    driven.run(1.0)
    assert abs(driven.pose() - before).max() < 1e-3
    steering = [robot.dof(f"ankle_yaw_{leg}") for leg in (1, 2, 3, 4)]
    assert abs(robot.command.velocity[steering]).max() < 5e-3  # no wheel hunts


@pytest.mark.soak
def test_the_estimate_goes_on_after_a_short_standstill(driven):
    """Odometry misses 0.3 s amid a curve: it must continue near its earlier estimate, not restart from the origin."""

    def error() -> np.ndarray:
        estimate = driven.odometry.robot.command.position
        x, y, _, heading = driven.pose()
        return np.array((estimate[0] - x, estimate[1] - y, math.remainder(estimate[5] - heading, math.tau)))

    driven.drive(0.5, x=SPEED)
    before, offset = driven.pose(), error()
    for asleep in (True, False):
        for _ in range(6):
            driven._velocity.write(FieldsMessage({"linear": {"x": SPEED}, "angular": {"z": TURN}}))
            driven.run(0.05)
            if asleep:
                driven.asleep.add("odometry")
        driven.asleep.discard("odometry")
    driven.run(1.7)
    assert np.linalg.norm(driven.pose()[:2] - before[:2]) > 0.05
    np.testing.assert_allclose(error(), offset, atol=8e-3)  # at the origin it would be 0.1 m off
    assert driven.odometry.running and driven.driver.running

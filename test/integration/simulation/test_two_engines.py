"""CENTAURO in both physics engines: what one says of it, the other one confirms."""

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from support.integration.world import ROBOT, perfect

from solfer.simulation import Simulation
from solfer.simulation.engines import make_engine
from solfer.simulation.rendering import renderer
from solfer.simulation.world.records import ENGINES

WEIGHT = 94.969 * 9.81


def stand(engine: str, world: Path | None = None) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return where the robot stands after 1 s, and what carries it."""
    with closing(Simulation.from_file(perfect(), engine=engine, world=world)) as simulation:
        for _ in range(1000):
            simulation.step()
        return simulation.q.copy(), simulation.contacts()


@pytest.fixture(scope="module")
def standing():
    return {engine: stand(engine) for engine in ENGINES}


def test_the_robot_stands_alike(standing):
    """Joints are equal to 2 mrad, since wheels creep in MuJoCo, and forces of wheels to 3 N."""
    (one, forces), (other, other_forces) = standing.values()
    np.testing.assert_allclose(one, other, atol=2e-3)
    assert forces.keys() == other_forces.keys() == {f"wheel_{leg}" for leg in (1, 2, 3, 4)}
    for wheel, force in forces.items():
        assert other_forces[wheel][2] == pytest.approx(force[2], abs=3.0)
    for each in (forces, other_forces):
        assert sum(force[2] for force in each.values()) == pytest.approx(WEIGHT, rel=2e-3)


def test_a_reset_returns_to_the_begin_to_the_bit():
    with closing(Simulation.from_file(perfect(), engine="mujoco")) as simulation:
        ends = []
        for _ in range(2):
            simulation.reset()
            for _ in range(200):
                simulation.step()
            ends.append((simulation.q.copy(), simulation.v.copy(), simulation.torque.copy()))
    assert all(np.array_equal(one, other) for one, other in zip(*ends, strict=True))


@pytest.mark.parametrize("world", ["slope", "boxes"])
def test_worlds_carry_the_robot_in_both_engines(repository, world):
    for engine in ENGINES:
        q, forces = stand(engine, repository / f"config/worlds/{world}.yaml")
        assert abs(q[3:5]).max() < 0.12
        assert np.linalg.norm(sum(forces.values())) == pytest.approx(WEIGHT, rel=0.01)


def test_both_engines_draw_the_robot_alike(monkeypatch):
    """The orange parts of the robot are at the same places of the picture."""
    pictures = []
    with closing(Simulation.from_file(ROBOT / "robot.yaml")) as simulation:
        for engine in ENGINES:
            monkeypatch.setattr(renderer, "make_engine", lambda draws, chosen=engine: make_engine(chosen, draws=draws))
            made = renderer.Renderer(simulation.kinematics.description, simulation.kinematics, 160, 120)
            with closing(made) as drawn:
                pictures.append(drawn.image(simulation.q).astype(int))
    orange = [picture[:, :, 0] > picture[:, :, 2] + 60 for picture in pictures]
    both = np.count_nonzero(orange[0] & orange[1])
    assert both > 0.6 * max(np.count_nonzero(each) for each in orange) > 30

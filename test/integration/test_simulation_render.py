"""Pictures without a display."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from solfer.errors import SimulationError
from solfer.simulation import Simulation
from solfer.simulation.render import Renderer, render

ROBOT = Path(__file__).resolve().parents[2] / "config/robots/centauro/robot.yaml"


@pytest.fixture(scope="module")
def simulation():
    """CENTAURO at its start."""
    simulation = Simulation.from_file(ROBOT)
    yield simulation
    simulation.close()


def orange(image):
    """Pixels that have the colour of the robot's covers."""
    red, green, blue = np.moveaxis(image.astype(int), 2, 0)
    return (red > green + 60) & (green > blue + 20)


def test_a_picture_shows_the_robot_and_follows_its_posture(simulation):
    renderer = Renderer(simulation.kinematics.description, simulation.kinematics, width=160, height=120)
    image = renderer.image(simulation.q)
    assert image.shape == (120, 160, 3) and image.dtype == np.uint8
    assert 0.01 < orange(image).mean() < 0.5
    turned = simulation.q.copy()
    turned[simulation.kinematics.dofs.index("torso_yaw")] = 1.0
    assert (np.abs(renderer.image(turned).astype(int) - image).max(axis=2) > 40).mean() > 0.01
    np.testing.assert_array_equal(renderer.image(simulation.q), image)
    renderer.close()


def test_a_simulation_is_drawn_to_a_file_and_not_disturbed(simulation, tmp_path):
    before = simulation.q.copy(), simulation.body.position.copy()
    render(simulation, tmp_path / "robot.png")
    picture = imread(tmp_path / "robot.png")
    assert picture.shape[:2] == (720, 960)
    assert 0.01 < orange(255 * picture[:, :, :3]).mean() < 0.5
    np.testing.assert_array_equal(simulation.q, before[0])
    np.testing.assert_array_equal(simulation.body.position, before[1])


def test_a_file_that_cannot_be_written(simulation, tmp_path):
    with pytest.raises(SimulationError, match="picture cannot be written"):
        render(simulation, tmp_path / "missing" / "robot.png")

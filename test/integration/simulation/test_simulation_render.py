"""Pictures without a display."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from solfer.errors import SimulationError
from solfer.simulation import Simulation
from solfer.simulation.rendering.renderer import Renderer, render

ROBOT = Path(__file__).resolve().parents[3] / "config/robots/centauro/robot.yaml"


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


def test_a_picture_follows_the_posture(simulation):
    renderer = Renderer(simulation.kinematics.description, simulation.kinematics, width=160, height=120)
    image = renderer.image(simulation.q)
    assert image.shape == (120, 160, 3) and image.dtype == np.uint8
    assert 0.01 < orange(image).mean() < 0.5
    turned = simulation.q.copy()
    turned[simulation.kinematics.dofs.index("torso_yaw")] = 1.0
    assert (np.abs(renderer.image(turned).astype(int) - image).max(axis=2) > 40).mean() > 0.01
    np.testing.assert_array_equal(renderer.image(simulation.q), image)
    renderer.close()


def test_drawing_does_not_disturb_the_simulation(simulation, tmp_path):
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

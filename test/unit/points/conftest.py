"""What the tests of points share."""

import pytest
from support.unit.random_states import accelerate, load


@pytest.fixture
def robot():
    """Put CENTAURO into a random motion, with accelerations."""
    robot = load("centauro")[0]
    accelerate(robot)
    return robot

"""What the integration tests share."""

import pytest
from support.integration.world import World
from support.integration.xbot_world import XbotWorld


@pytest.fixture
def world(request, tmp_path):
    """CENTAURO in memory, or in shared memory where a test asks for XBOT."""
    world = XbotWorld(tmp_path) if getattr(request, "param", "ROS") == "XBOT" else World()
    yield world
    world.close()


@pytest.fixture
def shared(tmp_path):
    """CENTAURO in shared memory."""
    world = XbotWorld(tmp_path)
    yield world
    world.close()

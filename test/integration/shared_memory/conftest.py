"""What the tests of this folder share."""

import pytest
from support.integration.xbot_system import system


@pytest.fixture
def robot():
    """Start a simulated robot in a namespace of its own."""
    with system() as made:
        made.simulate()
        yield made

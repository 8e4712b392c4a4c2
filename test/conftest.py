"""Settings and fixtures of all tests."""

from pathlib import Path

import pytest
from hypothesis import settings

# No deadline: a shared machine stalls now and then, and no test of ours is about time.
settings.register_profile("solfer", deadline=None, derandomize=True)
settings.load_profile("solfer")


@pytest.fixture(scope="session")
def repository() -> Path:
    """The folder that holds `package.xml`."""
    return Path(__file__).resolve().parent.parent

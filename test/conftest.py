"""Settings and fixtures of all tests."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Neither a deadline nor a look at how long examples take to make: a shared machine stalls now and then, and no test of
# ours is about time.
settings.register_profile(
    "solfer", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("solfer")


def pytest_collection_modifyitems(config, items):
    """Where several processes share the tests, those of a file stay together, for its fixtures; rostests have none."""
    if config.getoption("dist", "no") != "loadgroup":
        return
    for item in items:
        if item.path.name != "test_rostests.py":
            item.add_marker(pytest.mark.xdist_group(str(item.path)))


@pytest.fixture(scope="session")
def repository() -> Path:
    """The folder that holds `package.xml`."""
    return Path(__file__).resolve().parent.parent

"""Settings and fixtures of all tests."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from support import needs

TESTS = Path(__file__).resolve().parent

# Neither a deadline nor a look at how long examples take to make: a shared machine stalls now and then, and no test of
# ours is about time.
settings.register_profile("solfer", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("solfer")


def pytest_addoption(parser):
    parser.addoption(
        "--without", action="append", default=[], choices=sorted(needs.FILES), help="leave out tests that need this"
    )
    parser.addoption(
        "--robots",
        default="1",
        metavar="SEED|all",
        help="robots of collections that are simulated (default: %(default)s)",
    )


def pytest_configure(config):
    config.addinivalue_line("markers", "needs(name): what the test needs; see test/support/needs.py")
    needs.without.update(config.getoption("without"))


def pytest_report_header():
    return [f"without {name}: left out are {', '.join(needs.FILES[name])}" for name in sorted(needs.without)]


def pytest_ignore_collect(collection_path):
    return True if needs.left_out(collection_path.resolve().relative_to(TESTS)) else None


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Keep tests of one file together where two processes share them, for its fixtures; rostests have none."""
    from xdist.scheduler import LoadScopeScheduling

    class FileScheduling(LoadScopeScheduling):
        """Hands out files, and rostests one by one."""

        def _split_scope(self, nodeid: str) -> str:
            file = nodeid.partition("::")[0]
            return nodeid if file.endswith("test_rostests.py") else file

    return FileScheduling(config, log)


def pytest_collection_modifyitems(config, items):
    """Leave out tests that need what is missing."""
    missing = [item for item in items if any(needs.without.intersection(m.args) for m in item.iter_markers("needs"))]
    if missing:
        config.hook.pytest_deselected(items=missing)
        items[:] = [item for item in items if item not in missing]


@pytest.fixture(scope="session")
def repository() -> Path:
    """Return the folder that holds `package.xml`."""
    return TESTS.parent

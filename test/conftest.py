"""Settings and fixtures of all tests."""

import gc
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from support import needs

TESTS = Path(__file__).resolve().parent

UNHURRIED = {
    *("compensation", "figure_4_lockstep", "figures_2_3", "shared_control", "shared_lockstep", "table_1"),
    *("contract", "driving_lockstep", "figure_5", "ground_forces", "navigation", "package", "starts", "wheeled_motion"),
}
"""Rostests that another process may run beside the others: their simulation waits for its plugins, or there is none."""

REAL_TIME = ("ros", "integration/faults", "integration/realtime", "integration/shared_memory")
"""Tests of processes in real time. A machine that stands still for longer than a lease is a fault that no test
injected, so that one of these that fails runs once more; both runs are told. A defect fails twice."""

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
    config.pluginmanager.register(LongLived())


def pytest_report_header():
    return [f"without {name}: left out are {', '.join(needs.FILES[name])}" for name in sorted(needs.without)]


def pytest_ignore_collect(collection_path):
    return True if needs.left_out(collection_path.resolve().relative_to(TESTS)) else None


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Keep tests of one file together where processes share them, for its fixtures.

    They are handed out in the order of collection, the slow ones first. All rostests are one file: one process runs
    them one after the other, since two simulations in real time beside each other stall the plugins that they test;
    but UNHURRIED ones.
    """
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid):
            name = nodeid.partition("::test_rostest[")[2].rstrip("]")
            return nodeid if name in UNHURRIED else super()._split_scope(nodeid)

    config.option.loadscopereorder = False  # it would begin with the files that have the most tests
    return Scheduling(config, log)


def pytest_collection_modifyitems(config, items):
    """Leave out tests that need what is missing, and run some once more if they fail."""
    missing = [item for item in items if any(needs.without.intersection(m.args) for m in item.iter_markers("needs"))]
    if missing:
        config.hook.pytest_deselected(items=missing)
        items[:] = [item for item in items if item not in missing]
    for item in items:
        if any(item.path.is_relative_to(TESTS / folder) for folder in REAL_TIME):
            item.add_marker(pytest.mark.flaky(reruns=1))


def pytest_terminal_summary(terminalreporter):
    """Show why tests ran once more."""
    for report in terminalreporter.stats.get("rerun", ()):
        terminalreporter.section(f"first run of {report.nodeid}")
        terminalreporter.write_line(str(report.longrepr)[-5000:])


class LongLived:
    """Keeps the collector away from the million objects of all test modules: each look at them takes half a second.

    A loop that ends in this process lets them go; they are put away again before the next test.
    """

    def __init__(self):
        self._away, self._unfreeze = False, gc.unfreeze
        gc.unfreeze = self._let_go  # whether they are away could only be found out by counting them

    def _let_go(self):
        self._unfreeze()
        self._away = False

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self):
        if not self._away:
            gc.collect()
            gc.freeze()
            self._away = True

    def pytest_unconfigure(self):
        gc.unfreeze = self._unfreeze


@pytest.fixture(scope="session")
def repository() -> Path:
    """Return the folder that holds `package.xml`."""
    return TESTS.parent

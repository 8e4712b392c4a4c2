"""Settings and fixtures of all tests."""

import gc
import shutil
import tempfile
import threading
from collections import defaultdict
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from support import needs
from support.suite.repeat import MOST, Repeat
from support.suite.report import Report
from support.suite.stalls import StallRecorder

from solfer.supervision import supervise

TESTS = Path(__file__).resolve().parent

REAL_TIME = ("ros", "integration/faults", "integration/realtime", "integration/shared_memory", "integration/view")
"""Folders of tests in real time, which a stall of the machine may fail."""

GRACE = 1.5
"""Time from a signal until pytest is killed [s]; what its tests have started is killed at once."""

# Neither a deadline nor a look at how long examples take to make: a shared machine stalls now and then, and no test of
# ours is about time.
settings.register_profile("solfer", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("soak", settings.get_profile("solfer"), derandomize=False, max_examples=1000)
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


def is_worker(config) -> bool:
    """Return whether this process runs tests for another one, which prints."""
    return hasattr(config, "workerinput")


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config):
    """Go on in a process with which everything ends that tests start, unless a program with threads calls pytest."""
    if not is_worker(config) and threading.active_count() == 1:
        supervise(grace=GRACE)


def pytest_configure(config):
    needs.without.update(config.getoption("without"))
    if config.option.max_suite_reruns is None:
        config.option.max_suite_reruns = MOST
    config.pluginmanager.register(LongLived())
    config.pluginmanager.register(Repeat(), "repeat")
    if is_worker(config):
        return
    folder = Path(tempfile.mkdtemp(prefix="solfer-tests-"))
    config.add_cleanup(lambda: shutil.rmtree(folder))
    config.add_cleanup(StallRecorder(folder).close)
    config.pluginmanager.register(Report(TESTS.parent, config))


def pytest_report_header():
    return [f"without {name}: left out are {', '.join(needs.FILES[name])}" for name in sorted(needs.without)]


def pytest_ignore_collect(collection_path):
    return True if needs.left_out(collection_path.resolve().relative_to(TESTS)) else None


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    from support.suite.scheduling import Scheduling

    config.option.loadscopereorder = False  # it would begin with the files that have the most tests
    return Scheduling(config, log)


def leave_to_the_soak(items) -> None:
    """Mark the cases beyond those that the mark `daily` allows."""
    cases = defaultdict(list)
    for item in items:
        if item.get_closest_marker("daily"):
            cases[item.path, item.originalname].append(item)
    for group in cases.values():
        count = group[0].get_closest_marker("daily").args[0]
        daily = {round(index * (len(group) - 1) / max(count - 1, 1)) for index in range(count)}
        for index, item in enumerate(group):
            if index not in daily:
                item.add_marker(pytest.mark.soak)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Leave out tests that need what is missing, and the soak's unless their mark is selected."""
    repeat = config.pluginmanager.get_plugin("repeat")
    leave_to_the_soak(items)

    def is_left_out(item) -> bool:
        if any(needs.without.intersection(mark.args) for mark in item.iter_markers("needs")):
            return True
        return "soak" in item.keywords and "soak" not in config.option.markexpr

    left_out = [item for item in items if is_left_out(item)]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not is_left_out(item)]
    places = tuple(f"{TESTS / folder}/" for folder in REAL_TIME)
    for item in items:
        if str(item.path).startswith(places):
            repeat.excuse(item)


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

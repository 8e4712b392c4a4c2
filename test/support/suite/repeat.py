"""A failing test in real time runs again only if the machine stood still meanwhile."""

import time

import pytest
from support.suite.stalls import stalls_since

LEASE = 0.3
"""Shortest stall that excuses a failure [s]: after it the lower level takes joints away from a plugin."""

MOST = 2
"""Most repeated tests of a run."""


class Repeat:
    """Hooks of the process that runs tests."""

    def __init__(self) -> None:
        self._begin: dict[str, float] = {}
        self._stalls: dict[str, str] = {}

    def excuse(self, item: pytest.Item) -> None:
        """Let a test run again if it fails and the machine stalls for longer than LEASE, or its mark `lease`."""
        mark = item.get_closest_marker("lease")
        lease = mark.args[0] if mark else LEASE

        def has_stalled() -> bool:
            stalls = stalls_since(self._begin[item.nodeid], lease)
            self._stalls[item.nodeid] = "\n".join(map(str, stalls))
            return bool(stalls)

        item.add_marker(pytest.mark.flaky(reruns=1, condition=has_stalled))

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Note when a test begins."""
        self._begin[nodeid] = time.monotonic()

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add the stalls to the report of a test that runs again."""
        if report.outcome == "rerun" and report.nodeid in self._stalls:
            report.sections.append(("stalls", self._stalls[report.nodeid]))
            self._begin[report.nodeid] = time.monotonic()

"""What a run of the tests leaves to read: a log of what runs, times by folder, repeated and interrupted tests."""

import os
import signal
import time
from collections import defaultdict
from pathlib import Path

import pytest

LONGEST = 720.0
"""Longest time of all tests on an idle machine until the summary complains [s]."""


class Report:
    """Hooks of the process that prints.

    SIGTERM and SIGHUP end the run as SIGINT does. They print at once what has failed so far, since pytest may be killed
    before its summary.

    Args:
        root: Folder of the repository.
        config: What pytest was called with; without paths all tests run, whose time is limited.
    """

    def __init__(self, root: Path, config: pytest.Config):
        self._config = config
        self._is_whole = not config.option.file_or_dir
        self._failed: list[str] = []
        self._begin = time.monotonic()
        is_nested = "PYTEST_CURRENT_TEST" in os.environ  # a test runs tests
        self._path = Path(os.devnull) if is_nested else root / "build" / "tests.log"
        self._path.parent.mkdir(exist_ok=True)
        self._log = self._path.open("w", buffering=1)
        self._running: dict[str, float] = {}
        self._seconds: dict[str, float] = defaultdict(float)
        self._counts: dict[str, int] = defaultdict(int)
        self._owner = os.getpid()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, self._interrupt)

    def pytest_report_header(self) -> str:
        """Name the file of the log."""
        return f"log of the tests that run: {self._path}"

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Log the start of a test."""
        self._running[nodeid] = time.monotonic()
        self._note("starts", nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Log what failed, and sum up times."""
        folder = self._folder(report.nodeid)
        self._seconds[folder] += report.duration
        if report.outcome in ("failed", "rerun"):
            self._note(report.outcome.upper(), report.nodeid)
            self._failed.append(report.nodeid)
        if report.when == "teardown":
            self._counts[folder] += 1
            begin = self._running.pop(report.nodeid, time.monotonic())
            self._note(f"ended after {time.monotonic() - begin:.1f} s", report.nodeid)

    def pytest_terminal_summary(self, terminalreporter) -> None:
        """Print times by folder, and repeated tests with the stalls that excuse them."""
        for report in terminalreporter.stats.get("rerun", ()):
            terminalreporter.section(f"repeated: {report.nodeid}", yellow=True)
            for title, text in report.sections:
                if title == "stalls":
                    terminalreporter.write_line(text, yellow=True)
            terminalreporter.write_line(str(report.longrepr)[-5000:])
        if not self._is_whole:
            return
        terminalreporter.section("time by folder")
        for folder in sorted(self._seconds):
            seconds = self._seconds[folder]
            terminalreporter.write_line(f"{folder:30} {self._counts[folder]:6} tests {seconds:8.1f} s")
        passed = time.monotonic() - self._begin
        if passed > LONGEST:
            limit = f"expected: {LONGEST / 60.0:.0f} minutes at most on two idle cores"
            terminalreporter.write_line(f"the tests took {passed / 60.0:.1f} minutes; {limit}", red=True, bold=True)

    def pytest_unconfigure(self) -> None:
        """Close the log."""
        self._log.close()

    def _interrupt(self, number: int, _: object) -> None:
        if os.getpid() != self._owner:  # a fork that a test has made
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
        printer = self._config.pluginmanager.get_plugin("terminalreporter")
        with self._config.pluginmanager.get_plugin("capturemanager").global_and_fixture_disabled():
            printer.write_line(f"\n{signal.Signals(number).name}; failed so far: {len(self._failed)}", red=True)
            for nodeid in self._failed:
                printer.write_line(nodeid, red=True)
            for nodeid in self._running:
                printer.write_line(f"interrupted: {nodeid}", yellow=True)
            printer.flush()
        raise KeyboardInterrupt

    def _folder(self, nodeid: str) -> str:
        parts = Path(nodeid.partition("::")[0]).parts
        return "/".join(parts[1:3] if len(parts) > 3 else parts[1:2])

    def _note(self, event: str, nodeid: str) -> None:
        self._log.write(f"{time.strftime('%H:%M:%S')} {event} {nodeid}\n")

"""Carries out a study: starts workers, shows the progress, and writes the table."""

import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from solfer.errors import SolferError
from solfer_tools.study.engines import WorkerEngine, engine_of
from solfer_tools.study.folder import StudyFolder
from solfer_tools.study.plan import PlannedRun
from solfer_tools.study.result import Result

POLL_PERIOD = 0.25
"""Period in which the folder is read [s]."""


class StudyProgress:
    """Shows how far a study is, and names each run that failed.

    Args:
        folder: The study.
        total: How many rows there are in the end.
        log: Prints a line.
    """

    def __init__(self, folder: StudyFolder, total: int, log: Callable[[str], None]):
        self._folder = folder
        self._total = total
        self._log = log
        self._begin = time.monotonic()
        self._shown = 0.0
        results = {run.id: folder.result(run) for run in folder.distinct_runs if folder.is_done(run)}
        self._seen = set(results)
        self._before = len(results)
        self.failures = sum(result is not None and not result.done for result in results.values())

    def look(self) -> list[tuple[PlannedRun, Result]]:
        """Return the runs that are done since the last look."""
        found = []
        for run in self._folder.distinct_runs:
            if run.id in self._seen or (result := self._folder.result(run)) is None:
                continue
            self._seen.add(run.id)
            found.append((run, result))
            if not result.done:
                self.failures += 1
                self._log(f"run {run.id} failed ({run.text}): {result.failure.splitlines()[0]}")
        return found

    def show(self, is_last: bool = False) -> None:
        """Show the progress, once a second at most."""
        now = time.monotonic()
        done = len(self._seen)
        if now - self._shown < 1.0 and not is_last:
            return
        if not sys.stderr.isatty() and not is_last and now - self._shown < 10.0:
            return
        self._shown = now
        new = done - self._before
        total = self._total - len(self._folder.runs) + len(self._folder.distinct_runs)
        left = f", {(now - self._begin) / new * (total - done):.0f} s left" if new and not is_last else ""
        self._log(f"{done} of {total} runs, {self.failures} failed{left}")


def carry_out_all(
    folder: StudyFolder,
    engine: str,
    workers: int,
    options: dict[str, Any],
    log: Callable[[str], None],
) -> list[Path]:
    """Carry out all runs that have no result yet; return the files of the table.

    Raises:
        SolferError: Workers cannot work, or the folder cannot be written; the study goes on later.
    """
    progress = StudyProgress(folder, len(folder.runs), log)
    left = sum(not folder.is_done(run) for run in folder.distinct_runs)
    if left:
        with closing(engine_of(engine, folder.path, min(workers, left), follow=False, options=options)) as started:
            _wait(folder, started, progress)
    progress.look()
    progress.show(is_last=True)
    return folder.write_table()


def _wait(folder: StudyFolder, engine: WorkerEngine, progress: StudyProgress) -> None:
    table_period = 30.0  # [s]
    written = time.monotonic()
    while not all(folder.is_done(run) for run in folder.runs):
        engine.check()
        progress.look()
        progress.show()
        if time.monotonic() - written > table_period:
            folder.write_table()
            written = time.monotonic()
        time.sleep(POLL_PERIOD)


def find_run(folder: StudyFolder, name: str) -> PlannedRun:
    """Find a run by its id, a begin of it, or its number in the table.

    Raises:
        SolferError: There is none, or there are several.
    """
    found = {run.id: run for run in folder.runs if run.id.startswith(name) or str(run.index) == name}
    exact = {run.id: run for run in found.values() if name in (run.id, str(run.index))}
    if len(exact or found) != 1:
        raise SolferError(
            f"{len(found)} runs are named '{name}'", where=str(folder.path), expected="the id of one, as in table.csv"
        )
    return next(iter((exact or found).values()))

"""The folder of a study, which is its truth: what runs, its workers, and the results.

    study.json                  the study, and its plan
    runs/<id>/claim.<n>         the n-th worker that took up the run
    runs/<id>/config.yaml       what ran: its settings, then the effective configuration of each plugin
    runs/<id>/result.json       its result
    runs/<id>/columns.npz       the columns that are measured, some hundred rows, for pictures
    runs/<id>/recording.mcap    its recording, on request
    runs/<id>/stderr            what it logged
    table.csv, table.parquet    all results

Any number of workers on any machines share it. A claim is a file that only one of them can make; its age is the time
since its worker lived last, by the clock of the file system, so that those of the machines may differ.
"""

import csv
import io
import json
import os
import socket
import tempfile
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from solfer.errors import StudyError
from solfer.study.plan import Plan, PlannedRun, Study, study_of
from solfer.study.result import Result

STUDY = "study.json"
RUNS = "runs"
RESULT = "result.json"
CONFIGURATION_FILE = "config.yaml"
STDERR_FILE = "stderr"
RECORDING = "recording.mcap"
COLUMNS_FILE = "columns.npz"
CLAIM_PREFIX = "claim."

HEARTBEAT, DEAD = 2.0, 30.0
"""Period in which a worker renews its claim, and the age at which another one takes it over [s]."""


class Claim:
    """A run that a worker has taken up.

    Args:
        file: Its file.
    """

    def __init__(self, file: Path):
        self._file = file

    @property
    def attempt(self) -> int:
        """Number of the attempt, from 1 on."""
        return int(self._file.name.removeprefix(CLAIM_PREFIX))

    @property
    def folder(self) -> Path:
        """Folder of the run."""
        return self._file.parent

    def renew(self) -> None:
        """Show that the worker lives."""
        with suppress(FileNotFoundError):
            os.utime(self._file)


class StudyFolder:
    """The folder of a study.

    Args:
        path: The folder.

    Raises:
        StudyError: There is no study in it, or it cannot be read.
    """

    def __init__(self, path: Path):
        self.path = path
        self.load()

    @classmethod
    def create(cls, path: Path, study: Study, plan: Plan, record: bool = False, force: bool = False) -> "StudyFolder":
        """Make the folder of a study, or go on with it.

        Args:
            path: The folder.
            study: The study.
            plan: Its runs.
            record: Whether each run is recorded.
            force: Whether results of other code count, where all else is the same.

        Raises:
            StudyError: The folder cannot be written, or has runs of another study or of other code.
        """
        data = {
            "study": study.text(),
            "file": os.path.abspath(study.file),
            "record": record,
            "code": plan.code,
            "runs": [each.as_json() for each in plan.runs],
        }
        try:
            (path / RUNS).mkdir(parents=True, exist_ok=True)
            if (path / STUDY).exists():
                before = cls(path)
                data["runs"] = _continued(before, plan, force)
                before.repeat_interrupted()
            write_whole(path / STUDY, json.dumps(data, indent=1))
        except OSError as error:
            raise _unwritten(path, error) from None
        return cls(path)

    def load(self) -> None:
        """Read the plan again, to which a search adds runs.

        Raises:
            StudyError: There is none, or it cannot be read.
        """
        file = self.path / STUDY
        try:
            self._data = data = json.loads(file.read_text())
            self.code = data["code"]
            self.is_recorded = data["record"]
            self.runs = tuple(PlannedRun(**each) for each in data["runs"])
            self.study = study_of(data["study"], data["file"])
        except FileNotFoundError:
            raise StudyError(
                "there is no study", where=str(self.path), expected="a folder that `solfer study` made"
            ) from None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise StudyError(
                f"its study cannot be read: {error}", where=str(file), expected="what `solfer study` wrote"
            ) from None

    @property
    def distinct_runs(self) -> tuple[PlannedRun, ...]:
        """The runs of the plan, of equal ones the first: they have one folder and one result, and a row each."""
        return tuple({run.id: run for run in reversed(self.runs)}.values())[::-1]

    def add(self, run: PlannedRun) -> None:
        """Add a run to the plan.

        Raises:
            StudyError: It cannot be written.
        """
        self._data["runs"].append(run.as_json())
        self.runs = (*self.runs, run)
        try:
            write_whole(self.path / STUDY, json.dumps(self._data, indent=1))
        except OSError as error:
            raise _unwritten(self.path, error) from None

    def of(self, run: PlannedRun) -> Path:
        """Return the folder of a run."""
        return self.path / RUNS / run.id

    def result(self, run: PlannedRun) -> Result | None:
        """Return the result of a run; None: there is none yet."""
        try:
            return Result.from_json(json.loads((self.of(run) / RESULT).read_text()))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError) as error:
            where = str(self.of(run) / RESULT)
            raise StudyError(
                f"this result cannot be read: {error}",
                where=where,
                expected="what a worker wrote; remove it to repeat it",
            ) from None

    def is_done(self, run: PlannedRun) -> bool:
        """Whether a run has a result."""
        return (self.of(run) / RESULT).exists()

    def claim(self, run: PlannedRun) -> Claim | None:
        """Take up a run that nothing works on; None: it has a result, or another worker works on it.

        Raises:
            StudyError: The folder cannot be written.
        """
        folder = self.of(run)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            attempts = sorted(int(file.name.removeprefix(CLAIM_PREFIX)) for file in folder.glob(f"{CLAIM_PREFIX}*"))
            if self.is_done(run) or (attempts and not self._is_dead(folder / f"{CLAIM_PREFIX}{attempts[-1]}")):
                return None
            file = folder / f"{CLAIM_PREFIX}{attempts[-1] + 1 if attempts else 1}"
            place = os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o644)
        except FileExistsError:
            return None  # another worker was faster
        except OSError as error:
            raise _unwritten(folder, error) from None
        with os.fdopen(place, "w") as opened:
            json.dump(_identity(), opened)
        return Claim(file)

    def finish(self, run: PlannedRun, result: Result) -> None:
        """Write the result of a run; the first one counts.

        Raises:
            StudyError: It cannot be written.
        """
        folder = self.of(run)
        temporary = folder / f"{RESULT}.{uuid.uuid4().hex}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            temporary.write_text(json.dumps(result.as_json(), indent=1, sort_keys=True))
            with suppress(FileExistsError):
                os.link(temporary, folder / RESULT)
        except OSError as error:
            raise _unwritten(folder, error) from None
        finally:
            temporary.unlink(missing_ok=True)

    def repeat_interrupted(self) -> None:
        """Remove results that an earlier version wrote of runs that a signal had ended, so that these are repeated.

        Raises:
            OSError: One cannot be removed.
        """
        for run in self.distinct_runs:
            if (result := self.result(run)) is not None and result.is_interrupted:
                (self.of(run) / RESULT).unlink(missing_ok=True)

    def attempts(self, run: PlannedRun) -> int:
        """Return how often a run was taken up."""
        return sum(1 for _ in self.of(run).glob(f"{CLAIM_PREFIX}*"))

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows of the table, in the order of the plan."""
        names = self.study.names
        for run in self.runs:
            result = self.result(run)
            if result is None:
                continue
            row = {"run": run.index, "id": run.id, "seed": run.seed}
            row |= {name: _cell(run.variations.get(name)) for name in names}
            row |= {"failed": int(not result.done), "failure": result.failure.replace("\n", " ")}
            yield row | {name: result.measures.get(name) for name in self.study.record.measure}

    def write_table(self) -> list[Path]:
        """Write the table of all results, and return its files; Parquet needs `pyarrow`.

        Raises:
            StudyError: It cannot be written.
        """
        rows = list(self.rows())
        head = ["run", "id", "seed", *self.study.names, "failed", "failure", *self.study.record.measure]
        text = io.StringIO()
        writer = csv.DictWriter(text, head, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        files = [self.path / "table.csv"]
        try:
            write_whole(files[0], text.getvalue())
            with suppress(ImportError):
                files.append(_write_parquet(self.path / "table.parquet", head, rows))
        except OSError as error:
            raise _unwritten(self.path, error) from None
        return files

    def _is_dead(self, claim: Path) -> bool:
        """Whether the worker of a claim has ended: on this machine as soon as its process has."""
        try:
            identity = json.loads(claim.read_text())
            if identity["machine"] == _machine() and _started(identity["process"]) != identity["started"]:
                return True
        except (ValueError, KeyError):
            pass  # it is being written, or its worker died meanwhile
        except FileNotFoundError:
            return False
        with tempfile.TemporaryFile(dir=self.path) as now:
            now.write(b"0")
            now.flush()
            return os.fstat(now.fileno()).st_mtime - claim.stat().st_mtime > DEAD


def write_whole(file: Path, text: str) -> None:
    """Replace a file by another one at once, so that readers never see a part of it.

    Raises:
        OSError: It cannot be written; the file is as it was.
    """
    temporary = file.with_name(f"{file.name}.{uuid.uuid4().hex}")
    try:
        temporary.write_text(text)
        temporary.replace(file)
    finally:
        temporary.unlink(missing_ok=True)


def _continued(folder: StudyFolder, plan: Plan, force: bool) -> list[dict[str, Any]]:
    """Return the runs of a plan with which a folder goes on; with `force` those that other code has done stay.

    Raises:
        StudyError: The folder has results of another study, or of other code.
    """
    before = {run.key: run for run in folder.runs if folder.is_done(run)}
    if not force:
        if folder.code != plan.code and before:
            raise StudyError(
                f"{len(before)} runs were made by other code ({folder.code}, now {plan.code})",
                where=str(folder.path),
                expected="another folder, or --force to let their results count",
            )
        strange = before.keys() - {run.key for run in plan.runs}
        if strange and folder.study.record.search is None:
            raise StudyError(
                f"{len(strange)} runs belong to another study",
                where=str(folder.path),
                expected="another folder, or --force to leave them out",
            )
    if folder.study.record.search is not None:
        return [run.as_json() for run in folder.runs]
    kept = before if force else {}
    return [{**each.as_json(), "id": kept[each.key].id if each.key in kept else each.id} for each in plan.runs]


def _write_parquet(file: Path, head: list[str], rows: list[dict[str, Any]]) -> Path:
    import pyarrow
    from pyarrow import parquet

    table = pyarrow.table({name: [row.get(name) for row in rows] for name in head})
    temporary = file.with_name(f"{file.name}.{uuid.uuid4().hex}")
    try:
        parquet.write_table(table, temporary)
        temporary.replace(file)
    finally:
        temporary.unlink(missing_ok=True)
    return file


def _cell(value: Any) -> Any:
    """Return a value for a table: maps and lists as JSON."""
    return json.dumps(value) if isinstance(value, (Mapping, list, tuple)) else value


def _identity() -> dict[str, Any]:
    process = os.getpid()
    return {"machine": _machine(), "process": process, "started": _started(process), "time": time.time()}


def _machine() -> str:
    """Return a name of this machine since it was booted, and of those of its processes that have the same numbers."""
    boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    return f"{socket.gethostname()} {boot} {os.readlink('/proc/self/ns/pid')}"


def _started(process: int) -> str:
    """Return when a process of this machine has started, in ticks since the boot; empty: it does not live."""
    with suppress(OSError):
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return "" if fields[0] in "ZX" else fields[19]
    return ""


def _unwritten(path: Path, error: OSError) -> StudyError:
    return StudyError(
        f"it cannot be written: {error.strerror or error}", where=str(path), expected="a folder with room, of this user"
    )

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
import re
import socket
import tempfile
import time
import uuid
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, TypeAdapter, ValidationError

from solfer.errors import StudyError, writing
from solfer_tools.study.plan import OUTCOME, ROW, Plan, PlannedRun, ShortHash, Study, study_of
from solfer_tools.study.result import Result

STUDY = "study.json"
RUNS = "runs"
RESULT = "result.json"
CONFIGURATION_FILE = "config.yaml"
STDERR_FILE = "stderr"
RECORDING = "recording.mcap"
COLUMNS_FILE = "columns.npz"
CLAIM_PREFIX = "claim."

HEARTBEAT_PERIOD = 2.0
"""Period in which a worker renews its claim [s]."""

CLAIM_TIMEOUT = 30.0
"""Age of a claim at which another worker takes over its run [s]."""


class StudyFile(BaseModel):
    """What `study.json` holds, which others may have written."""

    study: str
    file: str
    record: bool
    code: ShortHash
    runs: list[PlannedRun]


class Identity(BaseModel):
    """The worker of a claim."""

    machine: str
    process: int
    started: str
    time: float


@dataclass(frozen=True)
class Claim:
    """A run that a worker has taken up.

    Attributes:
        file: Its file.
    """

    file: Path

    @property
    def attempt(self) -> int:
        """Number of the attempt, from 1 on."""
        return int(self.file.name.removeprefix(CLAIM_PREFIX))

    @property
    def folder(self) -> Path:
        """Folder of the run."""
        return self.file.parent

    def renew(self) -> None:
        """Show that the worker lives."""
        with suppress(FileNotFoundError):
            os.utime(self.file)


class StudyFolder:
    """The folder of a study.

    Args:
        path: The folder.

    Raises:
        StudyError: There is no study in it, or it cannot be read.
    """

    _RESULTS = TypeAdapter(Result)

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
        runs = list(plan.runs)
        with writing_to(path):
            (path / RUNS).mkdir(parents=True, exist_ok=True)
            if (path / STUDY).exists():
                before = cls(path)
                runs = _continued(before, plan, force)
                before.repeat_interrupted()
            file = os.path.abspath(study.file)
            _write(path, StudyFile(study=study.text(), file=file, record=record, code=plan.code, runs=runs))
        return cls(path)

    def load(self) -> None:
        """Read the plan again, to which a search adds runs.

        Raises:
            StudyError: There is none, or it cannot be read.
        """
        file = self.path / STUDY
        try:
            self._data = data = StudyFile.model_validate_json(file.read_bytes())
            self.code = data.code
            self.is_recorded = data.record
            self.runs = tuple(data.runs)
            self.study = study_of(data.study, data.file)
        except FileNotFoundError:
            raise StudyError(
                "there is no study", where=str(self.path), expected="a folder that `solfer study` made"
            ) from None
        except (OSError, ValueError, RecursionError) as error:
            raise StudyError(
                f"its study cannot be read: {_reason(error)}", where=str(file), expected="what `solfer study` wrote"
            ) from None
        for run in self.runs:
            if strange := run.variations.keys() - set(self.study.names):
                raise StudyError(
                    f"run {run.id} varies what the study does not: {', '.join(sorted(strange))}",
                    where=str(file),
                    expected="what `solfer study` wrote",
                )

    @property
    def distinct_runs(self) -> tuple[PlannedRun, ...]:
        """The runs of the plan, of equal ones the first: they have one folder and one result, and a row each."""
        return tuple({run.id: run for run in reversed(self.runs)}.values())[::-1]

    def add(self, run: PlannedRun) -> None:
        """Add a run to the plan.

        Raises:
            StudyError: It cannot be written.
        """
        self._data.runs.append(run)
        self.runs = (*self.runs, run)
        with writing_to(self.path):
            _write(self.path, self._data)

    def of(self, run: PlannedRun) -> Path:
        """Return the folder of a run."""
        return self.path / RUNS / run.id

    def result(self, run: PlannedRun) -> Result | None:
        """Return the result of a run; None: there is none yet."""
        try:
            return self._RESULTS.validate_json((self.of(run) / RESULT).read_bytes())
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            where = str(self.of(run) / RESULT)
            raise StudyError(
                f"this result cannot be read: {_reason(error)}",
                where=where,
                expected="what a worker wrote; remove it to repeat it",
            ) from None

    def is_done(self, run: PlannedRun) -> bool:
        """Whether a run has a result."""
        return (self.of(run) / RESULT).exists()

    def claim(self, run: PlannedRun) -> Claim | None:
        """Take up a run that nothing works on; None: it has a result, or another worker works on it.

        Raises:
            StudyError: The folder cannot be written, or leads elsewhere.
        """
        folder = self.of(run)
        with writing_to(folder):
            folder.mkdir(parents=True, exist_ok=True)
            self._check_inside(run)
            last = max(self._attempts(run), default=0)
            if self.is_done(run) or (last and not self._is_dead(folder / f"{CLAIM_PREFIX}{last}")):
                return None
            file = folder / f"{CLAIM_PREFIX}{last + 1}"
            process = os.getpid()
            own = Identity(machine=_machine(), process=process, started=_started(process), time=time.time())
            with suppress(FileExistsError):  # another worker was faster
                with file.open("x") as opened:
                    opened.write(own.model_dump_json())
                return Claim(file)
        return None

    def finish(self, run: PlannedRun, result: Result) -> None:
        """Write the result of a run; the first one counts.

        Raises:
            StudyError: It cannot be written.
        """
        folder = self.of(run)
        temporary = folder / f"{RESULT}.{uuid.uuid4().hex}"
        try:
            with writing_to(folder):
                folder.mkdir(parents=True, exist_ok=True)
                temporary.write_bytes(json.dumps(result.as_json(), indent=1, sort_keys=True).encode())
                with suppress(FileExistsError):
                    os.link(temporary, folder / RESULT)
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
        return len(self._attempts(run))

    def output(self, run: PlannedRun, name: str) -> Path:
        """Return the path for a new file of a run; the old one, which may be a link, is removed.

        Raises:
            StudyError: The folder of the run leads elsewhere.
            OSError: It cannot be removed.
        """
        self._check_inside(run)
        file = self.of(run) / name
        file.unlink(missing_ok=True)
        return file

    def columns(self, run_id: str) -> tuple[np.ndarray, list[str], np.ndarray] | None:
        """Return times, names and values of the columns that a run kept, shape (T,), (n,) and (n, T); None: none."""
        file = self.path / RUNS / run_id / COLUMNS_FILE
        try:
            with zipfile.ZipFile(file) as archive:
                if sum(each.file_size for each in archive.infolist()) > 2**26:  # [bytes]
                    return None
            with np.load(file) as kept:
                times = kept["times"].astype(float)
                names = [str(name) for name in kept["names"]]
                values = kept["values"].astype(float)
        except (  # what NumPy and `zipfile` raise of a file that is not one of theirs
            zipfile.BadZipFile,
            zlib.error,
            EOFError,
            OSError,
            ValueError,
            KeyError,
            TypeError,
            RuntimeError,
            MemoryError,
        ):
            return None
        return (times, names, values) if values.shape == (len(names), *times.shape) and times.ndim == 1 else None

    def _check_inside(self, run: PlannedRun) -> None:
        folder = self.of(run)
        if folder.resolve() != self.path.resolve() / RUNS / run.id:
            raise StudyError("it is a link", where=str(folder), expected="a folder in that of the study")

    def _attempts(self, run: PlannedRun) -> list[int]:
        """List the numbers of the claims of a run; other files beside them do not count, such as an editor's."""
        with suppress(FileNotFoundError):
            return [
                int(found[1])
                for name in os.listdir(self.of(run))
                if (found := re.fullmatch(r"claim\.([1-9][0-9]{0,8})", name))
            ]
        return []

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows of the table, in the order of the plan."""
        names = self.study.names
        for run in self.runs:
            result = self.result(run)
            if result is None:
                continue
            row: dict[str, Any] = dict(zip(ROW, (run.index, run.id, run.seed), strict=True))
            row |= {name: _cell(run.variations.get(name)) for name in names}
            row |= zip(OUTCOME, (int(not result.done), result.failure.replace("\n", " ")), strict=True)
            yield row | {name: result.measures.get(name) for name in self.study.record.measure}

    def write_table(self) -> list[Path]:
        """Write the table of all results, and return its files; Parquet needs `pyarrow`.

        Raises:
            StudyError: It cannot be written.
        """
        rows = list(self.rows())
        head = [*ROW, *self.study.names, *OUTCOME, *self.study.record.measure]
        text = io.StringIO()
        writer = csv.DictWriter(text, head, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        files = [self.path / "table.csv"]
        with writing_to(self.path):
            write_whole(files[0], text.getvalue().encode())
            with suppress(ImportError):
                files.append(_write_parquet(self.path / "table.parquet", head, rows))
        return files

    def _is_dead(self, claim: Path) -> bool:
        """Whether the worker of a claim has ended: on this machine as soon as its process has."""
        try:
            identity = Identity.model_validate_json(claim.read_bytes())
            if identity.machine == _machine() and _started(identity.process) != identity.started:
                return True
        except ValidationError:
            pass  # it is being written, or its worker died meanwhile
        except FileNotFoundError:
            return False
        with tempfile.TemporaryFile(dir=self.path) as now:
            now.write(b"0")
            now.flush()
            return os.fstat(now.fileno()).st_mtime - claim.stat().st_mtime > CLAIM_TIMEOUT


def write_whole(file: Path, content: bytes) -> None:
    """Replace a file by another one at once, so that readers never see a part of it.

    Raises:
        OSError: It cannot be written; the file is as it was.
    """
    temporary = file.with_name(f"{file.name}.{uuid.uuid4().hex}")
    try:
        temporary.write_bytes(content)
        temporary.replace(file)
    finally:
        temporary.unlink(missing_ok=True)


def _write(folder: Path, data: StudyFile) -> None:
    """Write the study into its folder; numbers that are not finite as Python does.

    Raises:
        OSError: It cannot be written.
    """
    write_whole(folder / STUDY, json.dumps(data.model_dump(), indent=1).encode())


def _reason(error: Exception) -> str:
    """Return in one line why a file cannot be read."""
    if not isinstance(error, ValidationError):
        return str(error)
    first = error.errors(include_url=False, include_input=False)[0]
    place = ".".join(map(str, first["loc"]))
    return f"{place}: {first['msg']}" if place else first["msg"]


def _continued(folder: StudyFolder, plan: Plan, force: bool) -> list[PlannedRun]:
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
        return list(folder.runs)
    kept = before if force else {}
    return [replace(each, id=kept[each.key].id) if each.key in kept else each for each in plan.runs]


def _write_parquet(file: Path, head: list[str], rows: list[dict[str, Any]]) -> Path:
    import pyarrow
    from pyarrow import parquet

    columns = {}
    for name in head:
        values = [row.get(name) for row in rows]
        try:
            columns[name] = pyarrow.array(values)
        except (pyarrow.ArrowException, OverflowError):  # values of different types
            columns[name] = pyarrow.array([None if value is None else str(value) for value in values])
    content = io.BytesIO()
    parquet.write_table(pyarrow.table(columns), content)
    write_whole(file, content.getvalue())
    return file


def _cell(value: Any) -> Any:
    """Return a value for a table: maps and lists as JSON."""
    return json.dumps(value) if isinstance(value, (Mapping, list, tuple)) else value


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


def writing_to(path: Path) -> AbstractContextManager[None]:
    """Raise a StudyError where a file or folder cannot be written."""
    return writing("it", path, StudyError, "a folder with room, of this user")

"""The folder of a study: who works on which run, and what becomes of the results."""

import csv
import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from support.unit.studies import made

from solfer.errors import StudyError
from solfer_tools.study import Result
from solfer_tools.study.drive import StudyProgress, find_run
from solfer_tools.study.folder import CLAIM_TIMEOUT, STUDY, StudyFolder

VARY = {"mass": {"path": "simulation/mass", "grid": [0.9, 1.0, 1.1]}}


@pytest.fixture
def folder(tmp_path):
    study = made(tmp_path, vary=VARY)
    return StudyFolder.create(tmp_path / "out", study, study.plan())


def owned(claim, **identity):
    """Write another owner into the file of a claim."""
    found = json.loads(claim.file.read_text())
    claim.file.write_text(json.dumps({**found, **identity}))


def test_of_many_workers_one_takes_up_a_run(folder):
    run = folder.runs[0]
    with ThreadPoolExecutor(16) as pool:
        claims = list(pool.map(lambda _: folder.claim(run), range(64)))
    assert sum(claim is not None for claim in claims) == 1
    assert folder.attempts(run) == 1


def test_a_run_of_a_process_that_has_ended_is_taken_up_again_at_once(folder):
    run = folder.runs[0]
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    owned(folder.claim(run), process=ended.pid, started="12345")
    again = folder.claim(run)
    assert again is not None and again.attempt == 2
    assert folder.claim(run) is None


def test_a_run_of_another_machine_is_taken_up_when_its_heartbeat_is_old(folder):
    run = folder.runs[0]
    claim = folder.claim(run)
    owned(claim, machine="another one")
    assert folder.claim(run) is None
    old = time.time() - CLAIM_TIMEOUT - 5.0
    os.utime(claim.file, (old, old))
    claim.renew()
    assert folder.claim(run) is None
    os.utime(claim.file, (old, old))
    assert folder.claim(run).attempt == 2


def test_the_first_result_counts(folder):
    run = folder.runs[1]
    folder.finish(run, Result("", {"tilt": 0.1}, 1.0))
    folder.finish(run, Result("late", {"tilt": 0.2}, 1.0))
    assert folder.result(run) == Result("", {"tilt": 0.1}, 1.0)
    assert folder.claim(run) is None
    assert sorted(path.name for path in folder.of(run).iterdir()) == ["result.json"]


@pytest.mark.parametrize(
    ("failure", "is_kept"),
    [
        ("SystemExit: 143 (at /src/solfer_tools/study/worker.py:220 in <lambda>)", False),
        ("KeyboardInterrupt (at /src/solfer/numerics/qp.py:7 in solve)", False),
        ("its process ended by signal SIGUSR2; see stderr", False),
        ("its process ended by signal SIGSEGV; see stderr", True),
        ("move: SystemExit: 143", True),
    ],
)
def test_runs_that_an_earlier_version_counted_as_failed_by_a_signal_are_repeated(folder, tmp_path, failure, is_kept):
    folder.finish(folder.runs[0], Result(failure))
    folder.finish(folder.runs[1], Result("", {"tilt": 0.1}, 1.0))
    study = made(tmp_path, vary=VARY)
    again = StudyFolder.create(folder.path, study, study.plan())
    assert [again.is_done(run) for run in again.runs] == [is_kept, True, False]


def test_equal_runs_are_one_run_with_a_row_each(tmp_path):
    """Of a grid with a value that repeats: progress counts it once, and its name or number finds it."""
    study = made(tmp_path, vary={"mass": {"path": "simulation/mass", "grid": [0.9, 1.0, 0.9]}})
    folder = StudyFolder.create(tmp_path / "out", study, study.plan())
    lines: list[str] = []
    progress = StudyProgress(folder, len(folder.runs), lines.append)
    for run in folder.distinct_runs:
        folder.finish(run, Result("fallen"))
    assert len(progress.look()) == 2
    progress.show(is_last=True)
    assert lines[-1] == "2 of 2 runs, 2 failed"
    assert [(row["run"], row["mass"]) for row in folder.rows()] == [(0, 0.9), (1, 1.0), (2, 0.9)]
    assert find_run(folder, folder.runs[0].id).id == find_run(folder, "2").id == folder.runs[2].id


def test_the_table_has_the_order_of_the_plan_and_no_wall_times(folder):
    for number in (2, 0, 1):
        folder.finish(folder.runs[number], Result("" if number else "fallen,\nat once", {"tilt": 0.1 * number}, 0.2))
    folder.write_table()
    rows = list(csv.DictReader((folder.path / "table.csv").read_text().splitlines()))
    assert [row["run"] for row in rows] == ["0", "1", "2"]
    assert [row["mass"] for row in rows] == ["0.9", "1.0", "1.1"]
    assert rows[0] | {"id": ""} == {
        "run": "0", "id": "", "seed": "0", "mass": "0.9", "failed": "1", "failure": "fallen, at once", "tilt": "0.0",
    }  # fmt: skip


def test_parquet_has_the_same_rows(folder):
    parquet = pytest.importorskip("pyarrow.parquet")
    for run in folder.runs:
        folder.finish(run, Result("", {"tilt": 0.1}, 0.2))
    assert parquet.read_table(folder.write_table()[1]).to_pylist() == list(folder.rows())


def test_the_same_study_goes_on_and_another_one_is_refused(folder, tmp_path):
    folder.finish(folder.runs[0], Result("", {"tilt": 0.1}, 1.0))
    study = made(tmp_path, vary=VARY)
    assert StudyFolder.create(folder.path, study, study.plan()).result(folder.runs[0]) is not None
    other = made(tmp_path, vary=VARY, duration=0.4)
    with pytest.raises(StudyError, match="1 runs belong to another study"):
        StudyFolder.create(folder.path, other, other.plan())


def test_results_of_other_code_count_only_by_force(folder, tmp_path):
    folder.finish(folder.runs[0], Result("", {"tilt": 0.1}, 1.0))
    data = json.loads((folder.path / STUDY).read_text())
    (folder.path / STUDY).write_text(json.dumps(data | {"code": "0" * 16}))
    study = made(tmp_path, vary=VARY)
    with pytest.raises(StudyError, match="made by other code"):
        StudyFolder.create(folder.path, study, study.plan())
    forced = StudyFolder.create(folder.path, study, study.plan(), force=True)
    assert forced.result(forced.runs[0]) is not None


def test_a_folder_that_cannot_be_written_is_one_error(folder, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    study = made(tmp_path, vary=VARY)
    with pytest.raises(StudyError, match="cannot be written"):
        StudyFolder.create(blocked, study, study.plan())


def test_a_full_disk_is_one_error_and_leaves_the_plan_as_it_is(folder, monkeypatch):
    """A study on a full disk can be continued once there is room."""
    before = (folder.path / STUDY).read_text()

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    for act in (
        lambda: folder.finish(folder.runs[0], Result("")),
        lambda: folder.add(folder.runs[0]),
        lambda: folder.write_table(),
    ):
        with pytest.raises(StudyError, match="No space left on device"):
            act()
    assert (folder.path / STUDY).read_text() == before
    assert not folder.is_done(folder.runs[0])


@pytest.mark.parametrize("text", ["", "{", "[]", '{"study": 1}'])
def test_a_damaged_study_is_one_error(folder, text):
    (folder.path / STUDY).write_text(text)
    with pytest.raises(StudyError, match="cannot be read"):
        StudyFolder(folder.path)


def test_a_folder_without_a_study_is_an_error(tmp_path):
    with pytest.raises(StudyError, match="there is no study"):
        StudyFolder(tmp_path)

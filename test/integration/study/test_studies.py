"""Studies of CENTAURO in PyBullet: repeatable, killed, by every engine, and what fails in them."""

import csv
import importlib.util
import io
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout, suppress

import numpy as np
import pytest
from support.unit.studies import CONFIG, made, written

from solfer.supervision import descendants
from solfer_tools.cli.main import main
from solfer_tools.study import SimulatedRun, run
from solfer_tools.study.folder import StudyFolder

SOLFER = CONFIG.parent / "nodes/solfer"

VARY = {"mass": {"path": "simulation/mass", "grid": [0.95, 1.05]}}
DRIVES = {
    "motion": {"scenario": {"file": str(CONFIG / "studies/ahead_and_turn.yaml")}},
    "measure": {
        "way": {"columns": "simulation/base/x", "reduce": "change"},
        "tilt": {"columns": "simulation/base/tilt", "reduce": "max"},
    },
}


def study(*arguments):
    """Run the command in this process; return its exit code and what it printed. Its workers are processes."""
    with io.StringIO() as text, redirect_stdout(text), redirect_stderr(text):
        return main(["study", *map(str, arguments)]), text.getvalue()


def table(folder):
    return (folder / "table.csv").read_text()


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Make a study of four runs by one worker, which nothing disturbs; return its folder."""
    folder = tmp_path_factory.mktemp("undisturbed")
    code, output = study(written(folder, vary=VARY, runs=2), "--out", folder / "out", "--workers", 1)
    assert code == 0, output
    return folder / "out"


def test_runs_repeat_to_the_bit(tmp_path):
    record = made(
        tmp_path, **DRIVES, duration=1.0, simulation={"transport": {"file": str(CONFIG / "transport/busy.yaml")}}
    ).record
    ways = []
    for _ in range(2):
        with SimulatedRun(record, seed=3) as simulated:
            for _ in range(2):
                simulated.step(0.25)
            simulated.reset()
            simulated.step(1.0)
            ways.append((simulated.columns["simulation/base/x"].copy(), simulated.observe()))
    np.testing.assert_array_equal(ways[0][0], ways[1][0])
    assert ways[0][1] == ways[1][1] and len(ways[0][0]) > 150


def test_an_interrupt_in_a_cycle_ends_the_run(tmp_path):
    def interrupted():
        raise KeyboardInterrupt

    with SimulatedRun(made(tmp_path, **DRIVES).record) as simulated:
        simulated.plugins["wheeled_motion"].cycle = interrupted
        with pytest.raises(KeyboardInterrupt):
            simulated.step()


def test_a_robot_drives_as_its_scenario_asks(tmp_path):
    found = run(CONFIG / "centauro.yaml", ["odometry3::odometry", "wheeled_motion"], 20.0, **DRIVES)
    assert found.done and found.measures["way"] == pytest.approx(0.5, abs=0.03)


def test_a_run_is_recorded_like_any_other(tmp_path):
    from solfer.recording.reader import read

    file = tmp_path / "run.mcap"
    tags = {"measure": DRIVES["measure"], "settle": 0.5}
    run(CONFIG / "centauro.yaml", ["odometry3::odometry", "wheeled_motion"], 1.0, recording=file, **tags)
    recording = read(file)
    assert len(recording["wheeled_motion/timing"].times) > 150 and not recording.lost
    assert np.isfinite(recording["wheeled_motion/truth"].values[10:]).all()


def test_a_repeated_run_says_what_the_folder_says(undisturbed):
    code, output = study("none.yaml", "--out", undisturbed, "--rerun", 2)
    row = list(csv.DictReader(table(undisturbed).splitlines()))[2]
    assert code == 0 and f"{float(row['tilt']):.9g}" in output


def end_by_signal(command, out, draw):
    """Start a study, and send a drawn signal to all of it, or to one of its processes, at a drawn moment; wait for it.

    That of a whole group is what a closed terminal, Ctrl-C, `timeout` and a batch system send.
    """
    begun = len(list(out.glob("runs/*/claim.*")))
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    is_early = draw.random() < 0.2
    while not is_early and len(list(out.glob("runs/*/claim.*"))) == begun and process.poll() is None:
        time.sleep(0.01)
    time.sleep(draw.uniform(0.0, 1.5))
    number = draw.choice([signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGUSR2, signal.SIGKILL])
    with suppress(ProcessLookupError):
        if draw.random() < 0.7:
            os.killpg(process.pid, number)
        else:
            os.kill(draw.choice([process.pid, *descendants(process.pid)]), number)
    process.wait(200.0)


@pytest.mark.daily(1)
@pytest.mark.parametrize("seed", range(20))
def test_a_study_that_is_ended_has_the_same_table(undisturbed, tmp_path, seed):
    """Signals end it, on any engine of this machine; no run is done twice but those that were ended."""
    draw = random.Random(seed)
    engine = ["dask", "local"][seed % 2] if importlib.util.find_spec("distributed") else "local"
    file, out = written(tmp_path, vary=VARY, runs=2), tmp_path / "out"
    arguments = [str(file), "--out", str(out), "--workers", "2", "--engine", engine]
    for _ in range(2):
        end_by_signal([sys.executable, str(SOLFER), "study", *arguments], out, draw=draw)
    code, output = study(*arguments)
    assert code == 0, output
    assert table(out) == table(undisturbed)
    folder = StudyFolder(out)
    assert sum(folder.attempts(each) - 1 for each in folder.runs) <= 4  # two workers, ended twice


def importable(monkeypatch, folder):
    """Let this process and its workers import modules of a folder."""
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", f"{folder}:{os.environ.get('PYTHONPATH', '')}")


@pytest.mark.parametrize(
    ("name", "ending"), [("killed", "os.kill(os.getpid(), signal.SIGHUP)"), ("exits", "sys.exit(4)")]
)
def test_a_run_that_is_ended_again_and_again_has_no_result_unless_it_ends_itself(tmp_path, monkeypatch, name, ending):
    (tmp_path / f"{name}.py").write_text(f"import os, signal, sys\ndef move(run, record):\n    {ending}\n")
    importable(monkeypatch, tmp_path)
    file = written(tmp_path, motion={"function": f"{name}:move"})
    code, output = study(file, "--out", tmp_path / "out", "--workers", 1)
    if name == "killed":
        assert code == 2 and "a run was ended 3 times by SIGHUP" in output
        assert not list(tmp_path.glob("out/runs/*/result.json"))
    else:
        (row,) = csv.DictReader(table(tmp_path / "out").splitlines())
        assert code == 1 and row["failure"] == "its process ended by exit code 1; see stderr"


def test_a_scheduler_that_is_not_there_is_one_error(tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    client = distributed.Client
    monkeypatch.setattr(distributed, "Client", lambda address, timeout: client(address, timeout="0.5s"))
    arguments = ["--engine", "dask", "--scheduler", "tcp://127.0.0.1:9", "--out", tmp_path / "out"]
    code, output = study(written(tmp_path, vary=VARY), *arguments)
    assert code == 2 and "no Dask scheduler answers" in output


def test_what_exceeds_its_limits_has_failed_and_the_others_go_on(tmp_path, monkeypatch):
    """A run that is too slow, too large or raises is a row with its reason; the study completes and exits with 1."""
    (tmp_path / "greedy.py").write_text(
        "import time\n"
        "def move(run, record):\n"
        "    if record.simulation.noise == 2.0:\n"
        "        time.sleep(60.0)\n"
        "    if record.simulation.noise == 3.0:\n"
        "        kept = [bytearray(10**8) for _ in range(40)]\n"
        "        time.sleep(60.0)\n"
        "    if record.simulation.noise == 4.0:\n"
        "        raise ValueError('four')\n"
        "    run.step(0.1)\n"
    )
    vary = {"noise": {"path": "simulation/noise", "grid": [1.0, 2.0, 3.0, 4.0]}}
    file = written(tmp_path, vary=vary, motion={"function": "greedy:move"}, limits={"time": 8.0, "memory": 2.0})
    importable(monkeypatch, tmp_path)
    code, output = study(file, "--out", tmp_path / "out", "--workers", 2)
    rows = list(csv.DictReader(table(tmp_path / "out").splitlines()))
    assert code == 1
    assert [row["failure"] for row in rows] == [
        "",
        "it took more than 8 s",
        "it took more than 2 GB of memory",
        "greedy:move: ValueError: four",
    ]
    assert Counter(row["failed"] for row in rows) == {"0": 1, "1": 3}
    assert "(noise 4): greedy:move: ValueError: four" in output


def test_a_search_finds_the_least_measure_and_goes_on_when_it_was_ended(tmp_path):
    """Trials that are equal are one run, and have a row each. One worker makes the same table each time."""
    pytest.importorskip("optuna")
    parameters = {"mass": {"path": "simulation/mass", "choice": [1.02, 0.9, 1.1]}}
    search = {"minimize": "off", "trials": 8, "parameters": parameters}
    measure = {"z": {"columns": "simulation/base/z", "reduce": "end"}, "off": {"derive": "abs(mass - 1.02)"}}
    file, out = written(tmp_path, search=search, measure=measure), tmp_path / "out"
    code, output = study(file, "--out", tmp_path / "undisturbed", "--workers", 1)
    assert code == 0 and "best of 8: 0 with mass 1.02, run " in output, output
    assert "choices" in (tmp_path / "undisturbed/search.log").read_text()  # values, and not places in the list
    assert "3 of 3 runs, 0 failed" in output
    rows = list(csv.DictReader(table(tmp_path / "undisturbed").splitlines()))
    assert [row["run"] for row in rows] == list("01234567") and len({row["id"] for row in rows}) == 3
    command = [sys.executable, str(SOLFER), "study", str(file), "--out", str(out), "--workers", "1"]
    end_by_signal(command, out, draw=random.Random(1))
    code, output = study(file, "--out", out, "--workers", 1)
    assert code == 0, output
    assert table(out) == table(tmp_path / "undisturbed")


def test_a_report_is_one_file_with_all_runs(undisturbed):
    code, output = study("report", undisturbed)
    page = (undisturbed / "report.html").read_text()
    assert code == 0 and output.strip() == str(undisturbed / "report.html")
    assert page.count("<tr class=run>") >= 4 and "--rerun" in page and "http" not in page


def test_bad_options_are_one_error(tmp_path, capsys):
    file = written(tmp_path, vary=VARY)
    for arguments, part in (
        ([file], "expected: --out DIR"),
        ([file, "--out", tmp_path / "out", "--runs", 0], "0 runs"),
        ([file, "--out", tmp_path / "out", "--workers", 0], "0 workers"),
        ([tmp_path / "none.yaml", "--dry"], "none.yaml"),
        (["report", tmp_path], "there is no study"),
        ([file, "--out", tmp_path, "--rerun", "1"], "there is no study"),
    ):
        assert main(["study", *map(str, arguments)]) == 2
        assert part in capsys.readouterr().err


def test_the_dry_run_lists_the_runs_and_the_hours(tmp_path):
    drawn = {"noise": {"path": "simulation/noise", "uniform": [0.5, 2.0]}}
    code, output = study(written(tmp_path, vary=VARY | drawn, runs=2), "--dry")
    assert code == 0 and "4 runs of 0.2 s at most" in output
    assert len(output.splitlines()) == 6 and not re.search(r"\d{6}", output)


def test_the_first_document_of_a_run_is_its_settings(undisturbed):
    masses = []
    for path in (undisturbed / "runs").glob("*/config.yaml"):
        settings, *plugins = path.read_text().split("---\n")
        masses.append(json.loads(settings)["simulation"]["mass"])
        assert len(plugins) == 2 and "modules:" in plugins[0]
    assert sorted(masses) == [0.95, 0.95, 1.05, 1.05]


PAGES = {
    "how-to/studies.md": ("robustness", 4, {"grid": [0.8]}, {"grid": [0.0, 5.0]}),
    "tutorials/one_hundred_simulations.md": ("hundred", 5, {"log_uniform": [0.3, 0.8]}, {"uniform": [0.0, 5.0]}),
}
"""Pages with commands, by the name of their study: how many they are, and how friction and payload vary."""


@pytest.mark.parametrize("name", PAGES)
def test_the_commands_of_the_page_run_on_a_study_of_this_size(repository, tmp_path, monkeypatch, name):
    """With a study of a few short runs in place of the shipped one, which varies in the same way."""
    shipped, count, friction, payload = PAGES[name]
    vary = {
        "friction": {"path": "simulation/friction/wheels", **friction},
        "payload": {"path": "simulation/payload/mass", **payload},
    }
    measure = {"off": {"columns": "simulation/base/tilt"}}
    fixed = {"payload": {"link": "torso_2", "mass": 0.0}}
    file = written(tmp_path, vary=vary, measure=measure, simulation=fixed, runs=1 if "grid" in friction else 2)
    page = (repository / "docs" / name).read_text()
    lines = re.findall(r"^solfer study (.*)$", page, re.MULTILINE)
    assert len(lines) == count
    monkeypatch.chdir(tmp_path)
    for line in lines:
        code, output = study(*line.replace(f"config/studies/{shipped}.yaml", str(file)).split())
        assert code == 0, (line, output)
    assert (tmp_path / f"{shipped}.png").stat().st_size > 5000


@pytest.mark.parametrize("number", [0, 1])
def test_the_python_of_the_page_runs(repository, monkeypatch, number):
    monkeypatch.chdir(repository)
    blocks = re.findall(
        r"^```python\n(.*?)^```", (repository / "docs/how-to/studies.md").read_text(), re.MULTILINE | re.DOTALL
    )
    assert len(blocks) == 2
    exec(compile(blocks[number], "docs/how-to/studies.md", "exec"), {})


@pytest.mark.slow
def test_the_benchmark_measures_a_page(repository):
    command = [sys.executable, str(repository / "benchmark/studies.py"), "report", "--runs", "20", "--json"]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert found["good"] and found["runs"] == 20


@pytest.mark.slow
def test_slurm_makes_the_same_table(undisturbed, repository, tmp_path, monkeypatch):
    if shutil.which("slurmctld") is None or os.getuid():
        pytest.skip("Debian's slurm-wlm and munge, as root")
    program = repository / "test/support/study/one_node_slurm"
    with tempfile.TemporaryDirectory(dir="/tmp") as node:  # the path of a socket has 107 characters at most
        subprocess.run([program, "start", node], check=True, stdout=subprocess.DEVNULL)
        try:
            monkeypatch.setenv("SLURM_CONF", f"{node}/slurm.conf")
            arguments = ["--out", tmp_path / "out", "--engine", "slurm", "--workers", 2]
            code, output = study(written(tmp_path, vary=VARY, runs=2), *arguments)
        finally:
            subprocess.run([program, "stop", node], check=False)
    assert code == 0, output
    assert table(tmp_path / "out") == table(undisturbed)


def test_a_full_disk_is_one_error_and_the_study_goes_on_when_there_is_room(undisturbed, tmp_path):
    """On a file system of its own, of which a file takes all but some kilobytes."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "none", disk], capture_output=True, check=False)
    if mounted.returncode:
        pytest.skip("a file system of its own, as root")
    try:
        file = written(tmp_path, vary=VARY, runs=2)
        (disk / "filler").write_bytes(b"0" * (2**20 - 40_000))
        code, output = study(file, "--out", disk / "out", "--workers", 2)
        assert code == 2
        assert "No space left" in output or "cannot be carried out" in output
        (disk / "filler").unlink()
        code, output = study(file, "--out", disk / "out", "--workers", 2)
        assert code == 0, output
        assert table(disk / "out") == table(undisturbed)
    finally:
        subprocess.run(["umount", "-l", disk], check=False)


@pytest.mark.soak
def test_a_scheduler_that_goes_away_is_one_error_and_the_study_goes_on(undisturbed, tmp_path):
    """A study whose Dask scheduler is killed can be continued, and has the table of an undisturbed one."""
    pytest.importorskip("distributed")
    place = tmp_path / "scheduler.json"
    scheduler = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard"]
        + ["--scheduler-file", str(place)],
        stderr=subprocess.DEVNULL,
    )
    worker = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(place), "--no-nanny"]
        + ["--nworkers", "1", "--nthreads", "2", "--no-dashboard", "--death-timeout", "20"],
        stderr=subprocess.DEVNULL,
    )
    try:
        while not place.exists():
            time.sleep(0.1)
        address = json.loads(place.read_text())["address"]
        file, out = written(tmp_path, vary=VARY, runs=2), tmp_path / "out"
        arguments = [sys.executable, str(SOLFER), "study", str(file), "--out", str(out)]
        process = subprocess.Popen(
            [*arguments, "--engine", "dask", "--scheduler", address, "--workers", "2"],
            stderr=subprocess.PIPE,
            text=True,
        )
        while not any(out.rglob("result.json")):
            time.sleep(0.1)
            assert process.poll() is None
        scheduler.kill()
        worker.kill()
        _, errors = process.communicate(timeout=120.0)
        assert process.returncode == 2 and "the study goes on" in errors and "Traceback" not in errors, errors
    finally:
        for each in (worker, scheduler):
            each.kill()
            each.wait()
    code, output = study(file, "--out", out, "--workers", 2)
    assert code == 0, output
    assert table(out) == table(undisturbed)

"""`solfer record` beside processes that record, and the process that writes a file for a loop."""

import multiprocessing
import os
import shutil
import signal
import time
from contextlib import closing

import numpy as np
import pytest
from support.processes import until

from solfer.errors import RecordingError
from solfer.recording.log import Logger
from solfer.recording.reader import read
from solfer.segments.namespace import Namespace
from solfer.telemetry.recorder import Recorder
from solfer.telemetry.recordings import FileRecorder, place_beside
from solfer_tools.cli.main import main

WAIT = 30.0  # [s]


@pytest.fixture
def namespace():
    name = f"recordings_{os.getpid()}"
    Namespace(name)
    yield name
    shutil.rmtree(f"/dev/shm/solfer-{name}", ignore_errors=True)


def source(plugin, numbers):
    log = Logger(plugin)
    log.add("x", numbers, ("x",), "m")
    loop = Logger("loop")
    loop.add("cycle", numbers.copy())
    return [*loop.sources, *log.sources]


@pytest.fixture
def recorders(namespace):
    """Two nodes that record a plugin each."""
    made = [Recorder(place_beside(namespace, f"/{name}"), source(name, np.ones(1)), 100.0) for name in ("arm", "leg")]
    for recorder in made:
        for number in range(1, 11):
            recorder.append(1_000_000 * number)
    yield made
    for recorder in made:
        recorder.close()


def test_nodes_of_a_namespace_are_in_one_file(namespace, recorders, tmp_path, capsys):
    file = tmp_path / "all.mcap"
    assert main(["record", namespace, str(file), "--last"]) == 0
    assert capsys.readouterr().out.count("10 cycles in 0.009 s, 0 lost") == 2
    found = read(file)
    assert set(found.channels) == {"loop/cycle", "loop_2/cycle", "arm/x", "leg/x"}
    assert all(len(channel.times) == 10 for channel in found.channels.values())


def test_plugins_are_recorded_by_name(namespace, recorders, tmp_path, capsys):
    file = tmp_path / "leg.mcap"
    assert main(["record", "-n", "leg", namespace, str(file), "--last"]) == 0
    assert set(read(file).channels) == {"leg/x"}
    assert main(["record", "-n", "lge", namespace, str(file), "--last"]) == 2
    error = capsys.readouterr().err
    assert "unknown plugin 'lge'" in error and "did you mean: leg" in error


def test_namespace_that_records_nothing_is_named(namespace, recorders, tmp_path, capsys):
    assert main(["record", f"{namespace}x", str(tmp_path / "x.mcap"), "--last"]) == 2
    error = capsys.readouterr().err
    assert f"unknown namespace that records '{namespace}x'" in error and f"did you mean: {namespace}" in error
    assert main(["record", namespace, str(tmp_path / "none" / "x.mcap"), "--last"]) == 2
    assert "the recording cannot be written: No such file or directory" in capsys.readouterr().err
    assert main(["record", namespace, str(tmp_path / "x.mcap"), "--seconds", "0.05"]) == 2
    assert "nothing was recorded" in capsys.readouterr().err and not list(tmp_path.iterdir())


def loop(namespace, file, started):
    """Record, with a file of its own, until the process is killed."""
    numbers = np.zeros(1)
    recorder = Recorder(Namespace(namespace).folder, source("arm", numbers), 1000.0)
    process = FileRecorder(namespace, ["arm"], file)
    for number in range(1, 100_000):
        numbers[:] = number
        recorder.append(1_000_000 * number)
        if number == 5000:
            started.put(process.process.pid)
        time.sleep(0.001)


@pytest.mark.soak
def test_killed_loop_leaves_a_complete_file(namespace, tmp_path):
    context, file = multiprocessing.get_context("fork"), tmp_path / "arm.mcap"
    started = context.Queue()
    process = context.Process(target=loop, args=(namespace, file, started), daemon=True)
    process.start()
    writer = started.get(timeout=WAIT)
    os.kill(process.pid, signal.SIGKILL)
    process.join(WAIT)
    until(lambda: not os.path.exists(f"/proc/{writer}/exe"))
    found = read(file)
    assert found.missing == () and found.lost == 0
    np.testing.assert_array_equal(np.diff(found["arm/x"].values[:, 0]), 1.0)
    assert found["arm/x"].values[-1, 0] >= 5000


def test_file_of_a_loop_is_complete_at_its_end(namespace, tmp_path):
    with closing(Recorder(Namespace(namespace).folder, source("arm", np.ones(1)), 1000.0)) as recorder:
        writer = FileRecorder(namespace, ["arm"], tmp_path / "arm.mcap")
        until(lambda: (tmp_path / "arm.mcap").exists())
        recorder.append(1_000_000)
    writer.close()
    assert read(tmp_path / "arm.mcap").missing == ()
    with pytest.raises(RecordingError, match="no file can be made there"):
        FileRecorder(namespace, ["arm"], tmp_path / "none" / "arm.mcap")

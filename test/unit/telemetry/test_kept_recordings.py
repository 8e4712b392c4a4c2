"""What a node leaves of its memory at its end, and the file that is made of it."""

import os
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
from support.recording.kept import write_kept

from solfer.recording.log import Logger
from solfer.recording.reader import read
from solfer.segments.lock import Lock
from solfer.segments.namespace import Namespace
from solfer.telemetry.recorder import Recorder
from solfer.telemetry.recordings import CRASH_AGE, YOUNG_AGE, keep, leave, recordings, sweep
from solfer.telemetry.rows import RECORDING


def test_memory_of_ended_node_becomes_a_file(tmp_path, monkeypatch):
    """A recording in shared memory outlives its node only where a folder is named, and is complete."""
    numbers, log = np.zeros(2), Logger("arm")
    log.add("error", numbers, ("x", "y"), "m")
    folder = tmp_path / "memory"
    folder.mkdir()
    recorder = Recorder(folder, log.sources, 100.0, 1.0, {"arm/robot.urdf": "<x/>"}, metadata={"seed": "3"})
    for cycle in range(40):
        numbers[:] = cycle, -cycle
        recorder.append(cycle * 10_000_000)
    for value in ("", str(tmp_path / "kept")):
        assert not (tmp_path / "kept").exists()
        monkeypatch.setenv("SOLFER_RECORDINGS", value)
        keep(folder, "/arm_node")
    recorder.close()
    (file,) = write_kept(tmp_path / "kept", tmp_path / "out")
    found = read(file)
    assert file.name == "arm_node.mcap" and found.metadata == {"seed": "3"} and found.missing == ()
    np.testing.assert_array_equal(found["arm/error"].column("y"), -np.arange(40.0))


def test_memory_that_cannot_be_kept_warns(tmp_path, caplog, monkeypatch):
    monkeypatch.setenv("SOLFER_RECORDINGS", str(tmp_path / "kept"))
    keep(tmp_path / "nowhere", "arm")
    assert "the last cycles are not kept" in caplog.text
    assert write_kept(tmp_path / "kept", tmp_path / "out") == []


def test_recordings_of_another_user_are_passed_over(tmp_path):
    """A closed folder of another user must not make the search fail; root changes its user to test it."""
    theirs = tmp_path / "solfer-theirs"
    theirs.mkdir()
    tmp_path.chmod(0o755)
    theirs.chmod(0)
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:  # nothing is closed to root, so that this needs a process that is not
        with suppress(BaseException):
            os.chdir(tmp_path)  # what is above it may be closed, too
            if os.geteuid() == 0:
                os.setuid(65534)
            os.write(writer, f"found {list(recordings(Path()))}".encode())
        os._exit(0)
    os.waitpid(child, 0)
    os.close(writer)
    assert os.read(reader, 100) == b"found []"
    os.close(reader)
    theirs.chmod(0o700)


def test_what_dead_nodes_of_other_masters_left_is_swept(tmp_path):
    """What a living process owns stays, and the own master's, a layer's, a new one, and a crash of today."""

    def left(name, age=2.0 * YOUNG_AGE, crash=None):
        """Make a namespace of some age [s] with the lock of a node and, after a crash, its recording."""
        file = Namespace(name, tmp_path).place("recordings", "arm", RECORDING)
        lock = Lock(file)
        if crash is not None:
            file.write_bytes(b"seconds")
            os.utime(file, (time.time() - crash,) * 2)
        then = time.time() - age
        os.utime(tmp_path / f"solfer-{name}", (then, then))
        return lock

    living = left("ros.1")
    for name in ("ros.2", "ros.3", "layer"):
        left(name).release()
    left("ros.4", age=0.5 * YOUNG_AGE).release()
    left("ros.5", crash=0.5 * CRASH_AGE).release()
    left("ros.6", crash=2.0 * CRASH_AGE).release()
    sweep("ros.3", tmp_path)
    kept = sorted(folder.name.removeprefix("solfer-") for folder in tmp_path.iterdir())
    assert kept == ["layer", "ros.1", "ros.3", "ros.4", "ros.5"]
    living.release()
    sweep("ros.3", tmp_path)
    assert not (tmp_path / "solfer-ros.1").exists()


def test_the_last_node_of_a_master_leaves_nothing(tmp_path):
    """Another node that lives, or has just made its folder, keeps all of it; so does what a crash has left."""
    place = Namespace("ros.0.1", tmp_path).place
    first, second = (Lock(place("recordings", name, RECORDING)) for name in ("arm", "leg"))
    folder = tmp_path / "solfer-ros.0.1"
    first.release()
    then = time.time() - 2.0
    os.utime(folder / "recordings", (then, then))
    leave("ros.0.1", tmp_path)
    assert folder.exists()
    second.release()
    place("recordings", "hand", RECORDING)
    leave("ros.0.1", tmp_path)
    assert folder.exists()
    os.utime(folder / "recordings", (then, then))
    crash = place("recordings", "head", RECORDING)
    crash.write_bytes(b"seconds")
    os.utime(folder / "recordings", (then, then))
    leave("ros.0.1", tmp_path)
    assert folder.exists()
    crash.unlink()
    leave("ros.0.1", tmp_path)
    assert not folder.exists()

"""What is recorded on this machine, by the names of plugins and namespaces, and the watchdog's loop."""

import os
from contextlib import ExitStack, closing
from types import SimpleNamespace

import numpy as np
import pytest

from solfer.errors import MiddlewareError, RecordingError, UnknownName
from solfer.realtime import watchdog
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.watchdog import Watchdog
from solfer.recording.log import Logger
from solfer.segments.namespace import Namespace
from solfer.telemetry import recordings
from solfer.telemetry.recorder import Recorder
from solfer.telemetry.recordings import (
    RUNNING,
    FileRecorder,
    namespace_of_master,
    of_namespace,
    of_plugins,
)


@pytest.fixture
def record(tmp_path):
    """Record plugins in a namespace, until the end of the test."""
    with ExitStack() as stack:

        def record(namespace, *plugins, beside=None):
            space = Namespace(namespace, tmp_path)
            folder = space.folder if beside is None else space.place(recordings.SHARED_FOLDER, beside, "f").parent
            sources = []
            for plugin in plugins:
                log = Logger(plugin)
                log.add("error", np.zeros(1), ("x",), "m")
                sources += log.sources
            stack.enter_context(closing(Recorder(folder, sources, 100.0, 1.0)))

        yield record


def refused(call, kind=MiddlewareError):
    with pytest.raises(kind) as error:
        call()
    return error.value.what, error.value.where, error.value.expected or ", ".join(error.value.names)


def test_recordings_are_found_by_plugins(record, tmp_path):
    """A plugin in two namespaces is ambiguous and needs one of them; a misspelt one gets the names recorded now."""
    record("one", "arm", "leg")
    record("two", "arm", beside="node")
    (drain,) = of_plugins(["leg"], root=tmp_path)
    assert tuple(drain.plugins) == ("leg",)
    assert [tuple(drain.plugins) for drain in of_plugins(["arm"], "two", tmp_path)] == [("arm",)]
    assert refused(lambda: of_plugins(["arm"], root=tmp_path)) == (
        "2 processes record a plugin 'arm'",
        "",
        "NAMESPACE of the one that is meant",
    )
    assert refused(lambda: of_plugins(["lge"], root=tmp_path), UnknownName) == (
        "unknown plugin 'lge'",
        "what is recorded now",
        "leg",
    )


def test_recordings_are_found_by_namespace(record, tmp_path):
    assert refused(lambda: of_plugins(["arm"], root=tmp_path), UnknownName)[2] == RUNNING
    record_all = "unknown namespace that records"
    assert refused(lambda: of_namespace("", tmp_path), UnknownName) == (
        f"{record_all} 'solfer'",
        str(tmp_path),
        RUNNING,
    )
    record("one", "arm")
    record("one", "leg", beside="node")
    assert [tuple(drain.plugins) for drain in of_namespace("", tmp_path)] == [("arm",), ("leg",)]
    record("two", "arm")
    assert refused(lambda: of_namespace("", tmp_path)) == ("2 namespaces record", "", "NAMESPACE, one of one, two")
    assert [tuple(drain.plugins) for drain in of_namespace("two", tmp_path)] == [("arm",)]
    assert refused(lambda: of_namespace("too", tmp_path), UnknownName) == (f"{record_all} 'too'", str(tmp_path), "two")


@pytest.mark.parametrize(
    ("uri", "port"),
    [("http://robot:11399", 11399), ("http://robot", 11311), ("", 11311), (None, 11311)],
)
def test_a_master_has_a_namespace_for_each_user(monkeypatch, uri, port):
    monkeypatch.delenv("ROS_MASTER_URI", raising=False)
    if uri is not None:
        monkeypatch.setenv("ROS_MASTER_URI", uri)
    monkeypatch.delenv("ROS_NAMESPACE", raising=False)
    namespace = f"ros.{os.geteuid()}.{port}"
    assert namespace_of_master() == namespace
    monkeypatch.setenv("ROS_NAMESPACE", "/left/")  # as roslaunch writes it
    assert namespace_of_master() == f"{namespace}.left"


def test_a_file_needs_a_folder(tmp_path):
    file = tmp_path / "none" / "a.mcap"
    assert refused(lambda: FileRecorder("one", ("arm",), file), RecordingError) == (
        "no file can be made there",
        str(file),
        "a folder that exists, and that you may write to",
    )


def test_a_file_recorder_waits_for_its_process(monkeypatch, tmp_path, caplog):
    """The end of the loop waits for the recording, but not for ever, and logs that it gave up."""
    monkeypatch.setattr(
        recordings.FileRecorder, "PROGRAM", "import sys, time; time.sleep(60 * (sys.argv[-2] == 'slow')); sys.exit(3)"
    )
    monkeypatch.setattr(FileRecorder, "TIMEOUT", 30.0)
    recorder = FileRecorder("quick", ("arm", "leg"), tmp_path / "a.mcap", 2.5)
    words = recorder.process.args[3:]
    assert words == ["record", "-n", "arm", "-n", "leg", "--whole", "--wait", "2.5", "quick", f"{tmp_path}/a.mcap"]
    recorder.close()
    assert recorder.process.poll() == 3 and caplog.messages == []
    monkeypatch.setattr(FileRecorder, "TIMEOUT", 0.01)
    recorder = FileRecorder("slow", ("arm",), tmp_path / "a.mcap")
    assert recorder.process.poll() is None
    recorder.close()
    assert caplog.messages == ["the recording ends before the loop, which goes on after 0.01 s"]
    assert recorder.process.wait(30.0) not in (0, 3)


class Lost:
    """A presence that is lost at a look."""

    loss = "the folder is gone"

    def __init__(self, looks):
        self.left = looks

    def lost(self):
        self.left -= 1
        return self.left < 0

    def require(self):
        raise MiddlewareError(self.loss)


def test_a_watchdog_looks_until_it_is_lost(tmp_path, monkeypatch):
    times = iter(np.arange(0.0, 10.0, 0.004))
    slept = []
    clock = SimpleNamespace(monotonic=lambda: next(times), sleep=slept.append)
    monkeypatch.setattr(watchdog, "time", clock)
    heartbeat = SimpleNamespace(beats=lambda: None, age=lambda: 0.0, alive=lambda: True, pid=1)
    stop = EmergencyStopLatch(tmp_path)
    with pytest.raises(MiddlewareError, match="the folder is gone"):
        Watchdog(heartbeat, stop, presence=Lost(4)).run(lambda: True)
    assert stop.reason.startswith("the folder is gone (")
    assert len(slept) == 4 and all(0.0 <= each <= watchdog.Watchdog.PERIOD for each in slept)
    looks = iter([True, True, False])
    Watchdog(heartbeat, stop).run(lambda: next(looks))
    assert len(slept) == 6

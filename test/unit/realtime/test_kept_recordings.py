"""What a node leaves of its memory at its end, and the file that is made of it."""

import numpy as np

from solfer.realtime.telemetry.recorder import Recorder
from solfer.realtime.telemetry.recordings import keep, write_kept
from solfer.recording.log import Logger
from solfer.recording.reader import read


def test_memory_of_ended_node_becomes_a_file(tmp_path):
    numbers, log = np.zeros(2), Logger("arm")
    log.add("error", numbers, ("x", "y"), "m")
    folder = tmp_path / "memory"
    folder.mkdir()
    recorder = Recorder(folder, log.sources, 100.0, 1.0, {"arm/robot.urdf": "<x/>"}, {"seed": "3"})
    for cycle in range(40):
        numbers[:] = cycle, -cycle
        recorder.record(cycle * 10_000_000)
    keep(folder, tmp_path / "kept" / "arm_node")
    recorder.close()
    (file,) = write_kept(tmp_path / "kept", tmp_path / "out")
    found = read(file)
    assert file.name == "arm_node.mcap" and found.metadata == {"seed": "3"} and found.missing == ()
    np.testing.assert_array_equal(found["arm/error"].column("y"), -np.arange(40.0))


def test_memory_that_cannot_be_kept_warns(tmp_path, caplog):
    keep(tmp_path / "nowhere", tmp_path / "kept")
    assert "the last cycles are not kept" in caplog.text
    assert write_kept(tmp_path / "kept", tmp_path / "out") == []

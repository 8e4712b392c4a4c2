"""What the node `xbot` records, and `solfer rt record` beside it: in good order, slow, and after a crash."""

import contextlib
import re
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from support.integration.world import CONFIG
from support.integration.xbot_system import REPOSITORY, WHEELS, XbotSystem, system, until
from support.realtime.executor_faults import SPEED, begin

from solfer.errors import RecordingError, UnknownName
from solfer.plugins import PluginState
from solfer.recording.model import Recording
from solfer.recording.reader import read
from solfer.telemetry.statistics import LoopCount
from solfer_tools.cli.main import main

WAIT = 60.0  # [s]
RATE = 500.0  # [Hz]
KEPT, SHORT = 10.0, 0.5
"""Seconds that a layer keeps by default, and one that shall lose something [s]."""


@pytest.fixture
def layer(tmp_path):
    """Write the file of a layer; `tags` are of its block `executor`."""

    def make(tags: str = "") -> Path:
        file = tmp_path / "layer.yaml"
        file.write_text(f"""
XBotRTPlugins: {{plugins: [joint_states]}}
mwoibn: {{config_file: {CONFIG / "centauro.yaml"}}}
executor: {{start: [joint_states], blend: 0.1, overruns: 1000000, schedule: {{lock_memory: false}}{tags}}}
""")
        return file

    return make


def recorder(robot: XbotSystem, file: Path, *arguments: str) -> subprocess.Popen:
    """`solfer rt record` as a process."""
    return robot.start(
        REPOSITORY / "nodes" / "solfer", "rt", "--namespace", robot.name, "record", str(file), *arguments
    )


def ended(process: subprocess.Popen) -> str:
    """Return the output of a process that has ended in good order."""
    text, _ = process.communicate(timeout=WAIT)
    assert process.returncode == 0, text
    return text


def following(process: subprocess.Popen, file: Path, count: int) -> None:
    """Wait until the recorder has put that many cycles into its file, which can be read at any time."""

    def written() -> bool:
        assert process.poll() is None, process.communicate()[0]
        with contextlib.suppress(RecordingError, UnknownName):  # no file yet, or no channel in it
            return len(cycles(read(file))) >= count
        return False

    until(written, "a recorder that follows")


def cycles(found: Recording) -> np.ndarray:
    """Return the numbers of the recorded cycles."""
    return found["loop/cycle"].values[:, 0].astype(int)


def check(found: Recording) -> np.ndarray:
    """Check that no cycle is missing and references were sent; returns measured speeds of the wheels that turn."""
    timing = found["loop/timing"]
    assert (np.diff(cycles(found)) == 1).all() and found.lost == 0 and not found.missing
    assert (np.diff(timing.times) > 0).all()
    assert (timing.column("duration") > 0).all() and (timing.column("lateness") >= 0).all()
    sent = found["joint_states/command/velocity_controller/velocity"]
    assert sent.columns == WHEELS
    wheels = [found["joint_states/measured/velocity"].columns.index(wheel) for wheel in WHEELS]
    desired, measured = (found[f"joint_states/{state}/velocity"].values[:, wheels] for state in ("wanted", "measured"))
    running = found["loop/states"].column("joint_states") == PluginState.RUNNING
    np.testing.assert_array_equal(sent.values[running], desired[running])
    return measured[running & (sent.values > SPEED / 2).all(axis=1)]


def test_a_killed_layer_leaves_its_last_seconds(layer, tmp_path, capsys):
    """The black box of a killed process can still be read, to its last cycle, as MCAP and as NPZ.

    Recorders that are interrupted or killed leave files that can be read as well.
    """
    with system() as robot:
        robot.simulate()
        node, statistics = begin(robot, layer())
        follower = recorder(robot, tmp_path / "live.mcap")
        following(follower, tmp_path / "live.mcap", 200)
        follower.send_signal(signal.SIGINT)
        assert ", 0 lost" in ended(follower)
        check(read(tmp_path / "live.mcap"))
        follower = recorder(robot, tmp_path / "killed.mcap")
        following(follower, tmp_path / "killed.mcap", 100)
        follower.kill()
        follower.wait()
        killed = read(tmp_path / "killed.mcap")
        assert (np.diff(cycles(killed)) == 1).all() and "its writer was killed" in killed.missing[-1]
        follower = recorder(robot, tmp_path / "whole.mcap", "--seconds", "1000")
        following(follower, tmp_path / "whole.mcap", 100)
        robot.drive(SPEED)
        node.kill()
        node.wait()
        assert "the recorded process has ended" in ended(follower)  # long before its time
        command = ["rt", "--namespace", robot.name, "record"]
        assert main([*command, str(tmp_path / "last.mcap"), "--last"]) == 0
        assert "the recorded process has ended, its last cycle was" in capsys.readouterr().out
        last, whole = read(tmp_path / "last.mcap"), read(tmp_path / "whole.mcap")
        assert (check(last) > SPEED / 2).all(axis=1).any() and last.attachments["joint_states/robot.urdf"]
        numbers = cycles(last)
        assert numbers[0] == max(1, numbers[-1] - KEPT * RATE + 2)
        assert numbers[-1] == cycles(whole)[-1] == pytest.approx(statistics.counts[LoopCount.CYCLES], abs=1)
        assert main([*command, str(tmp_path / "last.npz"), "--last", "--npz"]) == 0
        with np.load(tmp_path / "last.npz") as found:
            np.testing.assert_array_equal(found["loop/cycle"][:, 0], numbers)
            assert found["lost"] == 0 and tuple(found["loop/timing.columns"]) == ("lateness", "duration")
        assert not list(tmp_path.glob("*.new")) and not list(tmp_path.glob("*.npz.*"))
        assert main([*command, str(tmp_path / "none.mcap")]) == 2
        assert "has not made a cycle" in capsys.readouterr().err


@pytest.mark.soak
def test_a_recorder_that_is_too_slow_counts_losses(layer, tmp_path):
    """A recorder that pauses longer than the ring lasts counts exactly the cycles that its file lacks."""
    with system() as robot:
        robot.simulate()
        _, statistics = begin(robot, layer(f", record: {SHORT}"))
        follower = recorder(robot, tmp_path / "slow.mcap")
        following(follower, tmp_path / "slow.mcap", 50)
        follower.send_signal(signal.SIGSTOP)
        stopped = statistics.counts[LoopCount.CYCLES]
        until(lambda: statistics.counts[LoopCount.CYCLES] > stopped + 2 * SHORT * RATE, "more cycles than are kept")
        follower.send_signal(signal.SIGCONT)
        goes_on = statistics.counts[LoopCount.CYCLES]
        until(lambda: statistics.counts[LoopCount.CYCLES] > goes_on + SHORT * RATE, "cycles that are drained again")
        follower.send_signal(signal.SIGINT)
        lost = int(re.search(r"(\d+) lost", ended(follower))[1])
        found = read(tmp_path / "slow.mcap")
        gaps = np.diff(cycles(found)) - 1
        assert found.lost == lost == gaps.sum() > SHORT * RATE / 2
        assert statistics.alive

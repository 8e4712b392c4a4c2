"""What the node `xbot` records, and `solfer rt record` beside it: in good order, slow, and after a crash."""

import contextlib
import os
import re
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from support.integration.world import CONFIG
from support.integration.xbot_system import REPOSITORY, WHEELS, System, system, until
from support.realtime.executor_faults import SPEED, begin

from solfer.cli.main import main
from solfer.realtime.lifecycle import PluginState

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


def recorder(robot: System, file: Path, *arguments: str) -> subprocess.Popen:
    """`solfer rt record` as a process."""
    return robot.start(
        REPOSITORY / "nodes" / "solfer", "rt", "--namespace", robot.name, "record", str(file), *arguments
    )


def ended(process: subprocess.Popen) -> str:
    """Return the output of a process that has ended in good order."""
    text, _ = process.communicate(timeout=WAIT)
    assert process.returncode == 0, text
    return text


def following(process: subprocess.Popen, folder: Path, size: int) -> None:
    """Wait until the recorder has put that much into its file, which has no name [B]."""
    files = Path(f"/proc/{process.pid}/fd")

    def written() -> bool:
        assert process.poll() is None, process.communicate()[0]
        with contextlib.suppress(FileNotFoundError):  # another file was closed at this moment
            return any(
                file.stat().st_size >= size for file in files.iterdir() if os.readlink(file).startswith(str(folder))
            )
        return False

    until(written, "a recorder that follows")


def check(found: np.lib.npyio.NpzFile) -> np.ndarray:
    """Check that no cycle is missing and references were sent; returns measured speeds of the wheels that turn."""
    assert (np.diff(found["cycle"]) == 1).all() and found["lost"] == 0
    assert (np.diff(found["time"]) > 0).all() and (found["duration"] > 0).all() and (found["lateness"] >= 0).all()
    wheels = [found["joint_states.dofs"].tolist().index(wheel) for wheel in WHEELS]
    assert found["joint_states.sent.velocity_controller.joints"].tolist() == list(WHEELS)
    sent = found["joint_states.sent.velocity_controller.velocity"]
    wanted, measured = (found[f"joint_states.{state}.velocity"][:, wheels] for state in ("desired", "measured"))
    running = found["stages"][:, found["plugins"].tolist().index("joint_states")] == PluginState.RUNNING
    np.testing.assert_array_equal(sent[running], wanted[running])
    return measured[running & (sent > SPEED / 2).all(axis=1)]


def test_a_killed_layer_leaves_its_last_seconds(layer, tmp_path, capsys):
    with system() as robot:
        robot.simulate()
        node, statistics = begin(robot, layer())
        follower = recorder(robot, tmp_path / "live.npz")
        following(follower, tmp_path, 1_000_000)
        follower.send_signal(signal.SIGINT)
        assert ", 0 lost" in ended(follower)
        with np.load(tmp_path / "live.npz") as found:
            check(found)
        follower = recorder(robot, tmp_path / "whole.npz", "--seconds", "1000")
        following(follower, tmp_path, 500_000)
        robot.drive(SPEED)
        node.kill()
        node.wait()
        assert "the RT layer has ended" in ended(follower)  # long before its time
        command = ["rt", "--namespace", robot.name, "record"]
        assert main([*command, str(tmp_path / "last.npz"), "--last"]) == 0
        assert "the RT layer has ended, its last cycle was" in capsys.readouterr().out
        with np.load(tmp_path / "last.npz") as found, np.load(tmp_path / "whole.npz") as followed:
            assert (check(found) > SPEED / 2).all(axis=1).any()
            assert found["cycle"][0] == max(1, found["cycle"][-1] - KEPT * RATE + 2)
            assert found["cycle"][-1] == followed["cycle"][-1] == pytest.approx(statistics.counts[0], abs=1)
        assert not list(tmp_path.glob("*.new"))
        assert main([*command, str(tmp_path / "none.npz")]) == 2
        assert "has not made a cycle" in capsys.readouterr().err


def test_a_recorder_that_is_too_slow_counts_losses(layer, tmp_path):
    with system() as robot:
        robot.simulate()
        _, statistics = begin(robot, layer(f", record: {SHORT}"))
        follower = recorder(robot, tmp_path / "slow.npz")
        following(follower, tmp_path, 100_000)
        follower.send_signal(signal.SIGSTOP)
        stopped = statistics.counts[0]
        until(lambda: statistics.counts[0] > stopped + 2 * SHORT * RATE, "more cycles than are kept")
        follower.send_signal(signal.SIGCONT)
        goes_on = statistics.counts[0]
        until(lambda: statistics.counts[0] > goes_on + SHORT * RATE, "cycles that are drained again")
        follower.send_signal(signal.SIGINT)
        lost = int(re.search(r"(\d+) lost", ended(follower))[1])
        with np.load(tmp_path / "slow.npz") as found:
            gaps = np.diff(found["cycle"]) - 1
            assert found["lost"] == lost == gaps.sum() > SHORT * RATE / 2
        assert statistics.alive

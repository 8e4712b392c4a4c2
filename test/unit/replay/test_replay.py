"""What a plugin received, replayed through it: the same commands, or the first cycle and joint that differ."""

import dataclasses

import numpy as np
import pytest
from support.plugins.fleet import loaded
from support.recording.sine import WRENCH, Kept, Pressed, recorded, tree

from solfer.cli.main import main
from solfer.recording.reader import read
from solfer.recording.writer import save


@pytest.fixture
def recording(tmp_path):
    """Record the component in memory."""
    return recorded(tmp_path)


def test_unchanged_component_sends_the_same(recording, capsys):
    motion = read(recording)["first/command/left/position"]
    assert np.ptp(motion.column("roll")) > 0.2
    assert main(["replay", str(recording), "-n", "first"]) == 0, capsys.readouterr()
    out = capsys.readouterr().out
    assert "the same commands" in out and "the recording begins while the plugin runs" in out


def test_wrenches_of_contacts_are_recorded_and_replayed(tmp_path, capsys):
    file = recorded(tmp_path, "Pressing", 120, Pressed)
    found = read(file)
    for name in ("feedback/tip/value", "command/ground/tip"):
        wrench = found[f"first/{name}"]
        assert (wrench.kind, wrench.frame, wrench.columns[:3]) == (WRENCH, "world", ("fx", "fy", "fz"))
        assert wrench.column("fz")[-1] > 30.0
    assert main(["replay", str(file), "-n", "first"]) == 0, capsys.readouterr()
    still = found["first/feedback/tip/value"]
    pushed = {still.name: dataclasses.replace(still, values=still.values + 5.0)}
    save(dataclasses.replace(found, channels={**found.channels, **pushed}), tmp_path / "pushed.mcap")
    assert main(["replay", str(tmp_path / "pushed.mcap"), "-n", "first"]) == 1


def test_a_history_is_replayed_with_the_message_of_each_cycle(tmp_path, capsys):
    file = recorded(tmp_path, "Averaging", 120, Kept)
    assert main(["replay", str(file), "-n", "first"]) == 0, capsys.readouterr()


def test_requests_are_recorded_and_repeated(recording, tmp_path, capsys):
    whole = read(recording)
    assert [event.text for event in whole.events if event.kind == "request"] == ['["shift", {"data": true}]']
    save(dataclasses.replace(whole, events=()), tmp_path / "without.mcap")
    assert main(["replay", str(tmp_path / "without.mcap"), "-n", "first"]) == 1
    assert "in cycle 151" in capsys.readouterr().out


@pytest.mark.slow
def test_other_gain_names_first_cycle_and_joint(recording, tmp_path, capsys):
    loaded(tmp_path, tree("Strong"), ("first",))
    command = ["replay", str(recording), "-n", "first", "-c", str(tmp_path / "main.yaml")]
    assert main([*command, "--plot", str(tmp_path / "out.png")]) == 1, capsys.readouterr()
    out = capsys.readouterr().out
    states = read(recording)["first/life"].column("state")
    started = int((states == 3).argmax())
    assert f"differs first: roll of command/left/position in cycle {started + 1}" in out
    assert "shoulder" not in out
    assert (tmp_path / "out.png").stat().st_size > 1000

"""What a plugin received, replayed through it: the same commands, or the first cycle and joint that differ."""

import dataclasses

import numpy as np
import pytest
from matplotlib.image import imread
from support.plugins.fleet import loaded
from support.recording.sine import WRENCH, EveryMessage, Pressed, Slow, recorded, tree

from solfer.recording.reader import read
from solfer.recording.writer import save
from solfer_tools.cli.main import main


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
    file = recorded(tmp_path, "Averaging", 120, EveryMessage)
    assert main(["replay", str(file), "-n", "first"]) == 0, capsys.readouterr()


def test_the_robots_time_is_recorded_and_repeated(tmp_path, capsys):
    """A robot slower than the clock; a recording without its time cannot be repeated, and the report says so."""
    file = recorded(tmp_path, "Paced", 120, Slow)
    assert main(["replay", str(file), "-n", "first"]) == 0, capsys.readouterr()
    whole = read(file)
    life = whole["first/life"]
    assert life.column("passed")[60] == pytest.approx(0.6 * np.median(np.diff(life.times)))
    old = dataclasses.replace(life, columns=life.columns[:2], units=life.units[:2], values=life.values[:, :2])
    save(dataclasses.replace(whole, channels={**whole.channels, life.name: old}), tmp_path / "old.mcap")
    capsys.readouterr()
    assert main(["replay", str(tmp_path / "old.mcap"), "-n", "first"]) == 1
    assert "cannot be repeated: the time that passed for the robot" in capsys.readouterr().out


def test_a_difference_names_what_cannot_be_repeated(recording, tmp_path, capsys):
    """A pipe that was not recorded, cycles before the recording, and a request that was cut."""
    whole = read(recording)
    channels = {name: each for name, each in whole.channels.items() if "/feedback/" not in name}
    (event,) = (each for each in whole.events if each.kind == "request")
    cut = dataclasses.replace(event, text=event.text[:-3])
    save(dataclasses.replace(whole, channels=channels, events=[cut]), tmp_path / "cut.mcap")
    assert main(["replay", str(tmp_path / "cut.mcap"), "-n", "first"]) == 1
    doubts = [line for line in capsys.readouterr().out.splitlines() if line.startswith("cannot be repeated: ")]
    assert "which was not recorded: it gets what was measured" in doubts[0]
    assert 'request ["shift", {"data": ' in doubts[1] and "the recording, which begins while" in doubts[2]


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
    assert main([*command, "--plot", str(tmp_path / "narrow.png"), "--column"]) == 1
    assert imread(tmp_path / "narrow.png").shape[1] == 1050  # 3.5 inch of 300 pixels

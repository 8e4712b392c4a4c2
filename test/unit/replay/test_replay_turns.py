"""Recordings of one motion whose driver counts a continuous joint within a turn, on and on, or from any turn."""

import numpy as np
import pytest
from support.recording.sine import recorded
from support.recording.turning import DRIVERS, driven

from solfer.recording.reader import read
from solfer_tools.cli.main import main
from solfer_tools.review import compare, tracks_of


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Record each driver once."""
    files = {}

    def of(driver):
        if driver not in files:
            files[driver] = recorded(tmp_path_factory.mktemp("turns"), cycles=600, made=driven(DRIVERS[driver]))
        return files[driver]

    return of


@pytest.mark.parametrize("driver", DRIVERS)
def test_a_replay_sends_the_same(recording, driver, capsys):
    assert main(["replay", str(recording(driver)), "-n", "first"]) == 0, capsys.readouterr()
    assert "the same commands" in capsys.readouterr().out


@pytest.mark.parametrize("driver", DRIVERS)
def test_a_comparison_finds_no_difference(recording, driver):
    right, file = read(recording("counts on")), read(recording(driver))
    assert file.attachments["first/robot.urdf"].count(b'type="continuous"') == 1
    found = compare(right, file)
    assert not found.different
    same = compare(right, right)
    np.testing.assert_allclose(found.second, same.second, atol=1e-9)


@pytest.mark.parametrize("driver", DRIVERS)
def test_a_plot_has_no_jumps(recording, driver):
    """What is desired is sent in the driver's count, and drawn beside what is measured."""
    (right,), (track,) = (
        [each for each in tracks_of(read(recording(name)), "first") if each.joint == "roll"]
        for name in ("counts on", driver)
    )
    assert np.nanmax(np.abs(np.diff(track.measured.values[50:]))) < 1.0
    assert np.nanmax(np.abs(np.diff(track.desired.values[50:]))) < 1.0
    np.testing.assert_allclose(track.error()[50:], right.error()[50:], atol=1e-9)

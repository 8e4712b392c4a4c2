"""Recordings of one motion whose driver counts a continuous joint within a turn, on and on, or from any turn."""

import math

import numpy as np
import pytest
from support.recording.sine import Follower, recorded

from solfer.cli.main import main
from solfer.recording.comparison import compare
from solfer.recording.pictures.tracks import tracks_of
from solfer.recording.reader import read

FIRST, ROLL = 3.0, 1
"""Where the joint begins [rad], so that it crosses half a turn, and its place."""


def within(angle, begin=-math.pi):
    """Count an angle in [begin, begin + 2 pi)."""
    return begin + (angle - begin) % math.tau


DRIVERS = {
    "wraps": within,
    "begins at zero": lambda angle: within(angle, 0.0),
    "begins at another angle": lambda angle: within(angle, 3.1),
    "counts on": lambda angle: angle,
    "begins anywhere": lambda angle: angle + math.tau * float(np.random.default_rng(11).integers(-50, 50)),
    "begins far off": lambda angle: angle - math.tau * 41,
}


def driven(count):
    """Return a follower whose driver counts the continuous joint in its own way."""

    class Driven(Follower):
        """Joints that follow what they are sent."""

        def __init__(self, *args):
            super().__init__(*args)
            self.position[ROLL] = FIRST
            self.move()  # the component begins where the joints are

        def move(self):
            """See `Follower.move`."""
            dofs = [self.plugin.robot.dof(name) for name in ("shoulder", "roll")]
            if self.plugin.running:
                way = self.plugin.robot.command.position[dofs] - self.position
                self.position += 0.2 * (way - math.tau * np.rint(way / math.tau))
            noisy = self.position + self._drawn.normal(0.0, 1e-3, 2)
            noisy[ROLL] = count(noisy[ROLL])
            self.fleet.publish(position=noisy, velocity=np.zeros(2))

    return Driven


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
    assert np.nanmax(np.abs(np.diff(track.wanted.values[50:]))) < 1.0
    np.testing.assert_allclose(track.error()[50:], right.error()[50:], atol=1e-9)

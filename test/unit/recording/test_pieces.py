"""A recording that is read in pieces has the rows of the whole one, also where its writer came to no end."""

from contextlib import closing

import numpy as np
import pytest

from solfer.errors import RecordingError
from solfer.recording.model import COLUMNS_KIND, Channel, Event, Recording
from solfer.recording.reader import read
from solfer.recording.reading.pieces import RecordingPieces
from solfer.recording.writer import save


@pytest.fixture
def file(tmp_path):
    """Write three channels of 7 s: one slow, one that ends early."""
    random = np.random.default_rng(3)
    channels = {}
    for name, rate, end in (("arm/fast", 200.0, 7.0), ("arm/slow", 8.0, 7.0), ("leg/short", 50.0, 2.5)):
        times = 1000.0 + np.arange(0.0, end, 1.0 / rate)
        values = random.normal(size=(len(times), 3))
        channels[name] = Channel(name, COLUMNS_KIND, ("x", "y", "z"), ("m",) * 3, times=times, values=values)
    events = [Event(1000.0 + second, "arm", "request", str(second)) for second in range(6)]
    save(Recording(channels, events, {"arm/robot.urdf": b"<robot/>"}), tmp_path / "run.mcap")
    return tmp_path / "run.mcap"


def newest(channel, time):
    return channel.values[np.searchsorted(channel.times, time, side="right") - 1]


@pytest.mark.parametrize("cut", [0, 400], ids=["finished", "killed"])
def test_each_time_has_the_rows_of_the_whole(file, cut):
    file.write_bytes(file.read_bytes()[: -cut or None])
    whole = read(file)
    with closing(RecordingPieces(file)) as pieces:
        assert {each.name for each in pieces.channels} == set(whole.channels)
        assert pieces.begin == whole["arm/fast"].times[0] and pieces.end == whole["arm/fast"].times[-1]
        assert pieces.attachments == whole.attachments
        for time in np.random.default_rng(4).uniform(pieces.begin, pieces.end, 200):
            found = pieces.at(time)
            for name in ("arm/fast", "arm/slow"):
                np.testing.assert_array_equal(newest(found[name], time), newest(whole[name], time))
            assert ("leg/short" in found) == (np.floor(time - pieces.begin) <= 2.0)
        assert pieces.next_events(4) + pieces.next_events() == list(whole.events)
        assert not pieces.next_events()


def test_a_piece_is_read_once(file):
    with closing(RecordingPieces(file)) as pieces:
        assert pieces.at(1003.2) is pieces.at(1003.9) is not pieces.at(1004.1)


def test_numbers_that_are_not_wanted_are_not_read(file):
    whole, part = read(file), read(file, lambda channel: channel.name == "arm/slow")
    np.testing.assert_array_equal(part["arm/slow"].values, whole["arm/slow"].values)
    for name in ("arm/fast", "leg/short"):
        np.testing.assert_array_equal(part[name].times, whole[name].times)
        assert np.isnan(part[name].values).all() and part[name].values.strides == (0, 0)


def test_damaged_files_are_one_error_each(file):
    """Bytes changed at random, in the summary above all: never anything but a RecordingError, or fewer rows."""
    data = bytearray(file.read_bytes())
    random = np.random.default_rng(5)
    errors = 0
    for _ in range(300):
        changed = data.copy()
        for place in (len(data) * random.power(4.0, size=3)).astype(int):
            changed[place] = random.integers(256)
        file.write_bytes(changed)
        try:
            with closing(RecordingPieces(file)) as pieces:
                for time in (0.0, 1001.0, 1006.9, np.inf):
                    pieces.at(time)
                pieces.next_events()
        except RecordingError as error:
            errors += 1
            assert str(file) in error.where
    assert 30 < errors < 300

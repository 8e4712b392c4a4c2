"""A recording that is played shows what was recorded at each time."""

import argparse
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.page import opened_page  # noqa: E402
from support.robots import upper_body  # noqa: E402

from solfer import Robot  # noqa: E402
from solfer.errors import RecordingError  # noqa: E402
from solfer.middleware.memory import Bus, MemoryMiddleware  # noqa: E402
from solfer.recording.model import COLUMNS_KIND, JOINTS_KIND, Channel, Event, Recording  # noqa: E402
from solfer.recording.reading.pieces import RecordingPieces  # noqa: E402
from solfer.recording.writer import save  # noqa: E402
from solfer_tools.cli.view.actions import _picture, _recording  # noqa: E402
from solfer_tools.scene import LiveScene  # noqa: E402
from solfer_tools.view import Page, PageServer, Playback  # noqa: E402
from solfer_tools.view.playback import robot_of_recording  # noqa: E402

TIMES = 100.0 + np.arange(0.0, 4.0, 0.01)


@pytest.fixture(scope="module")
def robot(repository):
    return upper_body()


@pytest.fixture
def recording(robot):
    names = tuple(robot.dofs)
    values = np.sin(TIMES - 100.0)[:, None] * np.linspace(0.1, 0.5, len(names))
    units = ("rad",) * len(names)
    channels = [
        Channel(f"hands/{what}/position", JOINTS_KIND, names, units, times=TIMES, values=values + more)
        for what, more in (("measured", 0.0), ("command/position_controller", 0.1))
    ]
    texts = {"hands/robot.urdf": robot.description.text.encode()}
    events = [Event(101.0, "hands", "hold", "<b>no feedback</b>"), Event(102.0, "hands", "request", "left")]
    return Recording({each.name: each for each in channels}, events, attachments=texts)


def scene_at(playback, bus, scene, duration):
    bus.run_until(bus.time + 0.05)
    playback.advance(duration)
    return scene.update() if scene.update() is not None else None


def pieces_of(recording, folder):
    save(recording, folder / "run.mcap")
    return RecordingPieces(folder / "run.mcap")


@pytest.fixture
def pieces(recording, tmp_path):
    pieces = pieces_of(recording, tmp_path)
    yield pieces
    pieces.close()


@pytest.fixture
def played(pieces):
    bus, shown = Bus(), robot_of_recording(pieces)
    playback = Playback(pieces, MemoryMiddleware(bus, "recording"), shown)
    scene = LiveScene(shown, MemoryMiddleware(bus, "view"))
    return playback, lambda duration: scene_at(playback, bus, scene, duration)


def expected(robot, recording, channel, time):
    """Links at a time, by kinematics alone."""
    rows = recording[channel]
    other = Robot.load(robot.description.text)
    other.state.position[:] = rows.values[int(np.floor((time - 100.0) * 100.0 + 1e-6))]
    other.update()
    return other.kinematics


def test_links_are_those_of_the_row_at_each_time(robot, recording, played):
    playback, look = played
    look(0.0)
    for time in (0.5, 3.2, 1.23):  # also back
        playback.plays = False
        playback.seek(100.0 + time + 1e-6)
        state = look(0.05)
        assert playback.time == pytest.approx(100.0 + time, abs=1e-5)
        for found, channel in ((state.measured, "measured"), (state.desired, "command/position_controller")):
            kinematics = expected(robot, recording, f"hands/{channel}/position", playback.time)
            assert_allclose(found["arm1_7"].position, kinematics.position("arm1_7"), atol=1e-9)


def test_a_recording_beside_it_is_the_other_robot(robot, recording, tmp_path):
    """From its own begin on, at the same time after it."""
    later = {each.name: replace(each, times=each.times + 500.0, values=each.values + 0.2) for each in recording.filled}
    (tmp_path / "other").mkdir()
    pieces_of(recording, tmp_path).close()
    pieces_of(replace(recording, channels=later), tmp_path / "other").close()
    files = {"file": tmp_path / "run.mcap", "beside": tmp_path / "other" / "run.mcap"}
    source = _recording(argparse.Namespace(**files, robot=None))
    source.playback.plays = False
    source.playback.seek(101.5 + 1e-6)
    scene = LiveScene(source.robot, source.middleware)
    for _ in range(3):
        source.pace._step(0.05)
        state = _picture(scene, source.beside)
    for found, channels in ((state.measured, recording.channels), (state.desired, later)):
        rows = {"hands/measured/position": replace(channels["hands/measured/position"], times=TIMES)}
        kinematics = expected(robot, rows, "hands/measured/position", 101.5 + 1e-6)
        assert_allclose(found["arm1_7"].position, kinematics.position("arm1_7"), atol=1e-9)


def test_it_plays_at_its_speed_and_ends(played):
    playback, look = played
    playback.speed = 2.0
    look(0.5)
    assert playback.time == pytest.approx(101.0)
    for _ in range(5):
        look(0.5)
    assert playback.time == playback.end and not playback.plays
    playback.seek(0.0)
    assert playback.time == playback.begin


def test_columns_are_those_of_the_recording(recording, played):
    playback, look = played
    assert len(playback.names()) == sum(len(each.columns) for each in recording.channels.values())
    playback.plays = False
    playback.seek(102.0 + 1e-6)
    name = recording["hands/measured/position"].columns[3]
    found = playback.value(f"hands/measured/position/{name}")
    assert found == recording["hands/measured/position"].values[200, 3]
    assert np.isnan(playback.value("hands/measured/position/other")) and np.isnan(playback.value("other"))


def test_a_recording_without_rows_joints_or_robot_is_refused(robot, tmp_path):
    with pytest.raises(RecordingError, match="there are no rows"):
        pieces_of(Recording({}), tmp_path)
    times = np.array([0.0])
    other = Channel("hands/other", COLUMNS_KIND, ("x",), ("m",), times=times, values=times[:, None])
    with closing(pieces_of(Recording({"hands/other": other}), tmp_path)) as pieces:
        with pytest.raises(RecordingError, match="no plugin measures joints"):
            Playback(pieces, MemoryMiddleware(Bus(), "recording"), robot)
        with pytest.raises(RecordingError, match="it has no robot"):
            robot_of_recording(pieces)


@pytest.mark.slow
def test_the_time_line_takes_its_own_times_and_speeds_alone(pieces):
    """Speeds and times that are none change nothing; then those of the lists count."""
    bus = Bus()
    shown = robot_of_recording(pieces)
    playback = Playback(pieces, MemoryMiddleware(bus, "recording"), shown)
    with closing(PageServer(0)) as server:
        page = Page(server, shown.description, MemoryMiddleware(bus, "view"), playback=playback)
        with opened_page(server.address) as client:
            client.until(lambda: "time [s]" in client.labels, "a time line")
            for _ in range(5):
                page.update(None)
                client.receive(0.05)
            for mark in ("1.00 s hands hold &lt;b&gt;no feedback", "2.00 s hands request left"):
                assert mark in client.content

            def change(label, number):
                client.change(label, number)
                for _ in range(3):
                    client.receive(0.05)
                    page.update(None)

            for speed in ("nan", "inf", "-1", "1e308", float("nan"), float("inf"), 3):
                change("speed", speed)
                assert playback.speed == 1.0
            for time in (float("nan"), float("inf"), "1", None):
                change("time [s]", time)
                assert playback.time == playback.begin and playback.plays
            change("speed", "4")
            change("time [s]", 1e9)
            assert playback.speed == 4.0 and playback.time == pytest.approx(playback.end, abs=0.02)

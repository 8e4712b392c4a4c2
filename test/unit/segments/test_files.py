"""Folders and files of shared memory that another user has put there: refused, and nothing behind a link is touched."""

import os
import re
import stat
from pathlib import Path

import pytest

from solfer.errors import MiddlewareError, RecordingError
from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.recording.arrays import save_arrays
from solfer.recording.model import Recording
from solfer.recording.writer import RecordingWriter
from solfer.segments import files
from solfer.segments.lock import Lock
from solfer.segments.segment import Segment
from solfer.telemetry.recorder import Recorder
from solfer.telemetry.statistics import RuntimeStatistics

SECRET = b"what the robot's user keeps secret"


@pytest.fixture
def victim(tmp_path):
    """Write a file of the user, outside of the namespace."""
    path = tmp_path / "victim"
    path.write_bytes(SECRET)
    return path


@pytest.fixture
def folder(tmp_path):
    return Namespace("x", tmp_path).folder


def refused(act, where: Path, what: str) -> None:
    """Check that something is refused with the place, and a cure."""
    with pytest.raises(MiddlewareError) as refusal:
        act()
    assert re.search(what, refusal.value.what), refusal.value.what
    assert refusal.value.where == str(where) and refusal.value.expected


def test_modes_are_set_whatever_the_mask(tmp_path):
    for mask in (0o000, 0o022, 0o077):
        before = os.umask(mask)
        try:
            namespace = Namespace(f"mask{mask}", tmp_path)
            node = XbotMiddleware(namespace)
            node.provide("robot", "x")
            node.report("arm", 0, "good", {})
            EmergencyStopLatch(namespace.folder)
        finally:
            os.umask(before)
        made = [namespace.folder, *namespace.folder.rglob("*")]
        assert {stat.S_IMODE(path.stat().st_mode) for path in made if path.is_dir()} == {0o2770}
        assert {stat.S_IMODE(path.stat().st_mode) for path in made if path.is_file()} == {0o660}


@pytest.mark.parametrize("make", [True, False], ids=["maker", "looker"])
def test_a_folder_that_is_a_link_is_refused(tmp_path, make):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    folder = tmp_path / "solfer-x"
    folder.symlink_to(elsewhere)
    refused(lambda: Namespace("x", tmp_path, make), folder, "link")
    refused(lambda: Segment.create(folder / "estop", "estop", b"", 8), folder, "link")
    assert list(elsewhere.iterdir()) == []


@pytest.mark.parametrize("make", [True, False], ids=["maker", "looker"])
def test_a_world_writable_folder_is_refused(tmp_path, make):
    folder = tmp_path / "solfer-x"
    folder.mkdir()
    folder.chmod(0o1777)
    refused(lambda: Namespace("x", tmp_path, make), folder, "all users may write")
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    ("file", "act"),
    [
        ("bells", lambda folder: Namespace("x", folder.parent)),
        ("estop", EmergencyStopLatch),
        ("estop.lock", EmergencyStopLatch),
        ("statistics", lambda folder: RuntimeStatistics.create(folder, 500.0, ["a"], ["b"])),
        ("statistics.lock", lambda folder: Lock(folder / "statistics")),
        ("simulated_time", lambda folder: XbotMiddleware(Namespace("x", folder.parent))),
        ("recording", lambda folder: Recorder(folder, [], 500.0)),
        ("provided/robot", lambda folder: XbotMiddleware(Namespace("x", folder.parent)).parameter("robot")),
        (
            "pipes/t/robot",
            lambda folder: XbotMiddleware(Namespace("x", folder.parent), "robot").writer("t", "sensor_msgs/JointState"),
        ),
    ],
)
@pytest.mark.parametrize("lay", [Path.symlink_to, Path.hardlink_to], ids=["link", "second name"])
def test_nothing_is_opened_through_a_link(folder, victim, file, act, lay):
    trap = folder / file
    trap.parent.mkdir(parents=True, exist_ok=True)
    trap.unlink(missing_ok=True)
    lay(trap, victim)
    refused(lambda: act(folder), trap, "link|second name")
    assert victim.read_bytes() == SECRET


def test_a_linked_folder_below_is_refused(folder, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (folder / "pipes").symlink_to(elsewhere)
    node = XbotMiddleware(Namespace("x", tmp_path), "robot")
    refused(lambda: node.writer("t", "sensor_msgs/JointState"), folder / "pipes", "link")
    assert list(elsewhere.iterdir()) == []


def test_a_linked_draft_is_only_removed(folder, victim):
    (folder / "estop.new").symlink_to(victim)
    EmergencyStopLatch(folder).trip("a dog")
    assert victim.read_bytes() == SECRET
    assert EmergencyStopLatch(folder).reason.startswith("a dog")


def test_a_fifo_is_refused_without_blocking(folder):
    os.mkfifo(folder / "estop")
    refused(lambda: EmergencyStopLatch(folder), folder / "estop", "not a regular file")


def test_a_recording_is_written_through_no_link(victim, tmp_path):
    draft = tmp_path / f"out.npz.{os.getpid()}.new"
    draft.symlink_to(victim)
    with pytest.raises(RecordingError, match="File exists"):
        save_arrays(Recording({}), tmp_path / "out.npz")
    link = tmp_path / "out.mcap"
    link.symlink_to(victim)
    RecordingWriter(link).close()
    assert victim.read_bytes() == SECRET and draft.is_symlink() and not link.is_symlink()


def test_a_late_end_removes_no_newer_file(folder):
    old = Segment.create(folder / "statistics", "statistics", b"", 8)
    for path in folder.iterdir():
        path.unlink()
    new = Segment.create(folder / "statistics", "statistics", b"", 8)
    assert new.in_place() and not old.in_place()
    old.close()
    assert new.in_place() and new.owned()


ME, LEADER, STRANGER, ROBOTS, OTHERS = range(1001, 1006)
"""Users and groups: this process, the owner of the namespace, another user; the robot's group, another group."""


@pytest.mark.parametrize(
    ("user", "group", "opened"),
    [
        (ME, OTHERS, True),
        (0, OTHERS, True),
        (LEADER, OTHERS, True),
        (STRANGER, ROBOTS, True),
        (STRANGER, OTHERS, False),
        (1, OTHERS, False),
    ],
)
def test_files_of_few_users_are_opened(monkeypatch, tmp_path, user, group, opened):
    def status(mode, user, group):
        return os.stat_result((mode, 1, 1, 1, user, group, 0, 0, 0, 0))

    monkeypatch.setattr(os, "geteuid", lambda: ME)
    made, home = status(stat.S_IFREG | 0o660, user, group), status(stat.S_IFDIR | 0o770, LEADER, ROBOTS)
    if opened:
        files._check_file(made, home, tmp_path)
    else:
        refused(lambda: files._check_file(made, home, tmp_path), tmp_path, "a file of the user")

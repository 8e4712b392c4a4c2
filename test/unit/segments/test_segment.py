"""Segments: one owner, and nothing is opened that is not what is expected."""

import errno
import os
import stat

import pytest
from support.processes import kill, process
from support.unit.writers import KIND, LAYOUT, hold

from solfer.errors import MiddlewareError
from solfer.segments import segment as segment_module
from solfer.segments.header import LAYOUT_OFFSET, Word
from solfer.segments.segment import Segment


@pytest.fixture
def path(tmp_path):
    return tmp_path / "pipe"


def corrupt(path, word, value):
    """Write a word of the header without the segment's methods."""
    with open(path, "r+b") as file:
        file.seek(8 * word)
        file.write(value.to_bytes(8, "little", signed=True))


def test_what_the_owner_writes_others_see(path):
    owner = Segment.create(path, KIND, LAYOUT, 100)
    other = Segment.attach(path, KIND, LAYOUT)
    owner.data[:3] = b"abc"
    owner.beat(12345)
    assert bytes(other.data[:3]) == b"abc"
    assert (other.layout, other.pid, other.generation, other.heartbeat) == (LAYOUT, os.getpid(), 1, 12345)
    assert len(other.data) >= 100
    assert bytes(other.data[3:]) == bytes(len(other.data) - 3)


def test_others_cannot_write_unless_they_attach_writable(path):
    owner = Segment.create(path, KIND, LAYOUT, 8)
    with pytest.raises(TypeError):
        Segment.attach(path, KIND).data[0] = 1
    Segment.attach(path, KIND, writable=True).data[0] = 1
    assert owner.data[0] == 1


@pytest.mark.slow
def test_a_second_owner_is_refused_with_both_numbers(path):
    with process(hold, path) as child, pytest.raises(MiddlewareError) as refusal:
        Segment.create(path, KIND, LAYOUT, 8)
    assert f"process {child.pid} " in refusal.value.what
    assert f"process {os.getpid()} " in refusal.value.what
    assert refusal.value.where == str(path)


@pytest.mark.slow
def test_what_a_killed_owner_left_is_made_anew(path):
    with process(hold, path) as child:
        reader = Segment.attach(path, KIND)
        assert reader.owned()
        kill(child)
        assert not reader.owned()
        assert not reader.retired
    owner = Segment.create(path, KIND, b"{}", 8)
    assert owner.generation == reader.generation + 1
    assert reader.retired
    assert Segment.attach(path, KIND).layout == b"{}"


def test_recreate_keeps_the_ownership(path):
    first = Segment.create(path, KIND, LAYOUT, 8)
    reader = Segment.attach(path, KIND)
    second = first.recreate(b"{}", 4000)
    assert reader.retired and not second.retired
    assert (second.generation, second.layout) == (2, b"{}")
    assert len(reader.data) < 4000  # readers of the old one keep it
    with pytest.raises(MiddlewareError, match="writes here already"):
        Segment.create(path, KIND, LAYOUT, 8)
    first.close()
    assert Segment.attach(path, KIND).generation == 2


def test_an_end_is_seen_and_leaves_no_segment(path):
    owner = Segment.create(path, KIND, LAYOUT, 8)
    reader = Segment.attach(path, KIND)
    owner.close()
    assert reader.retired and not reader.owned()
    assert not path.exists()


def test_a_forked_child_does_not_keep_the_ownership(path):
    """Neither may a child's close remove the parent's pipe, nor a sleeping child block the next owner."""
    owner = Segment.create(path, KIND, LAYOUT, 8)
    child = os.fork()
    if not child:
        owner.close()
        os._exit(0 if path.exists() else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert owner.owned()
    sleeper = os.fork()
    if not sleeper:
        os.read(os.pipe()[0], 1)
    try:
        owner.close()
        Segment.create(path, KIND, LAYOUT, 8)
    finally:
        os.kill(sleeper, 9)
        os.waitpid(sleeper, 0)


@pytest.mark.parametrize("content", [b"", b"short", b"x" * 4096], ids=["empty", "short", "foreign"])
def test_a_foreign_file_is_neither_opened_nor_replaced(path, content):
    path.write_bytes(content)
    for attempt in (lambda: Segment.attach(path, KIND), lambda: Segment.create(path, KIND, LAYOUT, 8)):
        with pytest.raises(MiddlewareError) as refusal:
            attempt()
        assert refusal.value.where == str(path)
        assert refusal.value.expected
    assert path.read_bytes() == content


@pytest.mark.parametrize("left", [200, 64, 20])
def test_a_truncated_segment_is_refused_and_replaced(path, left):
    owner = Segment.create(path, KIND, LAYOUT, 1000)
    os.truncate(path, left)
    with pytest.raises(MiddlewareError) as refusal:
        Segment.attach(path, KIND)
    assert refusal.value.where == str(path)
    owner._lock.release()
    if left >= LAYOUT_OFFSET:
        assert Segment.create(path, KIND, LAYOUT, 8).generation == 2


def test_a_segment_from_before_boot_is_replaced(path):
    first = Segment.create(path, KIND, LAYOUT, 8)
    first._lock.release()
    corrupt(path, Word.BOOT, 0)
    assert Segment.create(path, KIND, LAYOUT, 8).generation == 2
    Segment.attach(path, KIND, LAYOUT)


def test_a_full_disk_is_an_error(path, monkeypatch):
    """Which is not filled here: others need it at the same time."""

    def fill(file, begin, size):
        os.ftruncate(file, size // 2)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as full, pytest.raises(MiddlewareError, match="cannot be made: No space left"):
        full.setattr(segment_module.os, "posix_fallocate", fill)
        Segment.create(path, KIND, LAYOUT, 4096)
    assert sorted(item.name for item in path.parent.iterdir()) == ["pipe.lock"]
    Segment.create(path, KIND, LAYOUT, 8)


def test_strangers_cannot_read_it(path):
    Segment.create(path, KIND, LAYOUT, 8)
    assert not path.stat().st_mode & stat.S_IRWXO

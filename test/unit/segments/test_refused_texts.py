"""What shared memory refuses, word for word, and text in it."""

import os
import sys

import numpy as np
import pytest
from support.unit.writers import KIND, LAYOUT

from solfer.errors import MiddlewareError, UnknownName
from solfer.segments import lock, presence
from solfer.segments.header import LAYOUT_OFFSET, VERSION, Word
from solfer.segments.lock import Lock
from solfer.segments.namespace import Namespace
from solfer.segments.presence import Presence
from solfer.segments.segment import Segment
from solfer.segments.text import Text

FOREIGN = "the file is not shared memory of solfer", "remove the file"
ROOM = "room in /dev/shm"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "pipe"


def refusal(call, where):
    with pytest.raises(MiddlewareError) as error:
        call()
    assert error.value.where == str(where)
    return error.value.what, error.value.expected


def put(path, word, value):
    """Write a word of the header without the segment's methods; return what it was."""
    with open(path, "r+b") as file:
        file.seek(8 * word)
        before = int.from_bytes(file.read(8), sys.byteorder, signed=True)
        file.seek(8 * word)
        file.write(value.to_bytes(8, sys.byteorder, signed=True))
    return before


def test_wrong_memory_says_what_is_wrong(path):
    """Each word of the header is damaged in turn: every fault has its own text and remedy, and then it opens again."""

    def attached(kind=KIND, layout=None):
        return refusal(lambda: Segment.attach(path, kind, layout), path)

    own = "shared memory of your own user"
    assert attached() == ("shared memory cannot be opened: No such file or directory", own)
    path.write_bytes(b"")
    assert attached() == ("the file is empty", "shared memory of solfer")
    path.write_bytes(b"x" * 4096)
    assert attached() == FOREIGN
    assert refusal(lambda: Segment.create(path, KIND, LAYOUT, 8), path) == FOREIGN
    path.unlink()
    segment = Segment.create(path, KIND, LAYOUT, 8)
    owner = f"end its owner, process {os.getpid()}"
    assert attached("other") == (f"shared memory of the kind '{KIND}'", "'other'")
    assert attached(KIND, b"other") == (f"shared memory of another layout: {LAYOUT.decode()}", "other")
    put(path, Word.VERSION, VERSION + 1)
    assert attached() == (
        f"shared memory of the version {VERSION + 1}",
        f"version {VERSION}: the same solfer in all processes",
    )
    put(path, Word.VERSION, VERSION)
    size = put(path, Word.SIZE, 3)
    assert attached() == (f"shared memory is damaged: {size} bytes", f"3 bytes; {owner}")
    put(path, Word.SIZE, size)
    boot = put(path, Word.BOOT, 0)
    assert attached() == ("shared memory from before the machine was started", "an owner that makes it again")
    put(path, Word.BOOT, boot)
    layout = put(path, Word.LAYOUT, 0)
    assert attached() == ("shared memory is damaged: its layout is not the one it was made with", owner)
    put(path, Word.LAYOUT, layout)
    Segment.attach(path, KIND, LAYOUT)
    assert os.path.getsize(path) == size >= LAYOUT_OFFSET + 8
    segment.close()


def test_memory_that_cannot_be_made_says_why(path, tmp_path):
    """No room, and no folder: users read the system's reason and where to look, not a bare OSError."""
    full = 2**62
    for call in (
        lambda: Segment.create(path, KIND, LAYOUT, full),
        lambda: Segment.create(path, KIND, LAYOUT, 8).recreate(LAYOUT, full),
    ):
        what, expected = refusal(call, path)
        assert what.startswith("shared memory cannot be made: ") and expected == ROOM
    nowhere = tmp_path / "nowhere" / "pipe"
    assert refusal(lambda: Segment.create(nowhere, KIND, LAYOUT, 8), nowhere) == (
        "shared memory cannot be made: No such file or directory",
        ROOM,
    )
    assert refusal(lambda: lock.remove(nowhere), nowhere) == (
        "shared memory cannot be removed: No such file or directory",
        "shared memory of your own user; see /dev/shm",
    )


def test_a_lock_says_who_has_it(path):
    held = Lock(path)
    pid = os.getpid()
    assert refusal(lambda: Lock(path), path) == (
        f"process {pid} writes here already, process {pid} may not",
        "one writer, or another namespace",
    )
    held.release()
    file = path.with_name("pipe.lock")
    file.write_bytes(b"1" * (lock.PID_SIZE + 1))
    assert refusal(lambda: Lock(path), file) == ("the file is not a lock of solfer", "remove the file")
    file.write_bytes(b"1" * lock.PID_SIZE)  # as long as a number may be
    Lock(path).release()


def test_namespaces_say_what_they_refuse(tmp_path):
    """Invalid, damaged, unknown and too long names, at the very limit of what a file system accepts."""
    assert refusal(lambda: Namespace("a b", tmp_path), "") == ("invalid namespace name 'a b'", "letters, digits, _ . -")
    (tmp_path / "solfer-bad").mkdir(mode=0o700)
    numbers = tmp_path / "solfer-bad" / "bells"
    numbers.write_bytes(b"123")
    numbers.chmod(0o600)
    assert refusal(lambda: Namespace("bad", tmp_path), numbers) == (
        "the file does not hold solfer's notifications: 3 bytes",
        "remove the file",
    )
    with pytest.raises(UnknownName, match="unknown namespace 'bat'") as unknown:
        Namespace("bat", tmp_path, make=False)
    assert unknown.value.names == ("bad",) and not (tmp_path / "solfer-bat").exists()
    space = Namespace("good", tmp_path)
    assert space.place("topics", "a/b").parent.is_dir()
    with pytest.raises(MiddlewareError, match="letters is too long for shared memory") as long:
        space.path("x" * 241)
    assert long.value.what.startswith("a name of 241 ") and long.value.expected == "a shorter name"
    assert space.path("x" * 240).name == "x" * 240


def test_a_lost_process_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(presence.Presence, "PERIOD", 0.0)
    space = Namespace("robot", tmp_path)
    here = Presence(space, [segment := Segment.create(space.place("estop"), KIND, LAYOUT, 8)])
    here.require()
    assert not here.lost() and here.loss == ""
    segment.path.unlink()
    assert here.lost()
    loss = here.loss
    with pytest.raises(MiddlewareError) as error:
        here.require()
    assert str(segment.path) in loss and error.value.what == f"no other process finds this one any more: {loss}"
    assert error.value.expected == "a new start, which makes the namespace again"


@pytest.mark.parametrize(("size", "width"), [(0, 1), (1, 2), (8, 2), (9, 3), (17, 4)])
def test_a_text_fits_its_numbers(size, width):
    assert Text.width(size) == width
    text = Text(np.zeros(width))
    assert text.size == 8 * (width - 1)
    longest = bytes(range(1, text.size + 1))
    text.write(longest)
    assert text.read() == longest
    text.write(longest[:-1])
    assert text.read() == longest[:-1]
    with pytest.raises(MiddlewareError) as error:
        text.write(longest + b"x")
    assert error.value.what == f"{text.size + 1} bytes do not fit into shared memory"
    assert error.value.expected == f"at most {text.size}" and text.read() == longest[:-1]

"""What shared memory refuses, and text in it."""

import os
import sys

import numpy as np
import pytest
from support.unit.refusals import check_refusal
from support.unit.writers import KIND, LAYOUT

from solfer.errors import MiddlewareError, UnknownName
from solfer.segments import lock, presence
from solfer.segments.header import VERSION, Word
from solfer.segments.lock import Lock
from solfer.segments.namespace import Namespace
from solfer.segments.presence import Presence
from solfer.segments.segment import Segment
from solfer.segments.text import Text

OWNER = f"end its owner, process {os.getpid()}"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "pipe"


def put(path, word, value):
    """Write a word of the header without the segment's methods; return what it was."""
    with open(path, "r+b") as file:
        file.seek(8 * word)
        before = int.from_bytes(file.read(8), sys.byteorder, signed=True)
        file.seek(8 * word)
        file.write(value.to_bytes(8, sys.byteorder, signed=True))
    return before


@pytest.mark.parametrize(
    ("word", "value", "words"),
    [
        (Word.MAGIC, 1, "the file is not shared memory of solfer (expected: remove the file)"),
        (Word.VERSION, VERSION + 1, f"of the version {VERSION + 1} (expected: version {VERSION}: the same solfer"),
        (Word.SIZE, 3, "damaged: SIZE bytes (expected: 3 bytes; OWNER)"),
        (Word.BOOT, 0, "shared memory from before the machine was started (expected: an owner that makes it again)"),
        (Word.LAYOUT, 0, "its layout is not the one it was made with (expected: OWNER)"),
        (Word.TEXT, 3, "damaged"),
    ],
)
def test_a_damaged_header_is_refused(path, word, value, words):
    """Each word is damaged in turn, and what is repaired opens again."""
    segment = Segment.create(path, KIND, LAYOUT, 8)
    words = words.replace("SIZE", str(path.stat().st_size)).replace("OWNER", OWNER)
    before = put(path, word, value)
    check_refusal(lambda: Segment.attach(path, KIND, LAYOUT), MiddlewareError, str(path), words)
    put(path, word, before)
    Segment.attach(path, KIND, LAYOUT)
    segment.close()


def test_other_memory_is_refused(path):
    def attach(kind=KIND, layout=None):
        return lambda: Segment.attach(path, kind, layout)

    check_refusal(attach(), MiddlewareError, str(path), "No such file or directory (expected: shared memory of your")
    path.write_bytes(b"")
    check_refusal(attach(), MiddlewareError, str(path), "the file is empty")
    path.unlink()
    segment = Segment.create(path, KIND, LAYOUT, 8)
    check_refusal(attach("other"), MiddlewareError, str(path), f"of the kind '{KIND}' (expected: 'other'")
    check_refusal(attach(KIND, b"other"), MiddlewareError, str(path), f"layout: {LAYOUT.decode()} (expected: other)")
    segment.close()


def test_memory_that_cannot_be_made_says_why(path):
    """No room, and no folder: users read the system's reason and where to look, not a bare OSError."""
    segment = Segment.create(path, KIND, LAYOUT, 8)
    nowhere = path.parent / "nowhere" / "pipe"
    for call, place, words in (
        (lambda: Segment.create(path.with_name("other"), KIND, LAYOUT, 2**62), path.with_name("other"), "/dev/shm"),
        (lambda: segment.recreate(LAYOUT, 2**62), path, "shared memory cannot be made: "),
        (lambda: Segment.create(nowhere, KIND, LAYOUT, 8), nowhere, "cannot be made: No such file"),
        (lambda: lock.remove(nowhere), nowhere, "shared memory cannot be removed: No such file"),
    ):
        check_refusal(call, MiddlewareError, str(place), words)


def test_a_lock_says_who_has_it(path):
    held = Lock(path)
    pid = os.getpid()
    words = f"process {pid} writes here already, process {pid} may not (expected: one writer, or another namespace)"
    check_refusal(lambda: Lock(path), MiddlewareError, str(path), words)
    held.release()
    file = path.with_name("pipe.lock")
    file.write_bytes(b"1" * (lock.PID_SIZE + 1))
    check_refusal(lambda: Lock(path), MiddlewareError, str(file), "the file is not a lock of solfer")
    file.write_bytes(b"1" * lock.PID_SIZE)  # as long as a number may be
    Lock(path).release()


def test_namespaces_say_what_they_refuse(tmp_path):
    """Invalid, damaged, unknown and too long names, at the very limit of what a file system accepts."""
    (tmp_path / "solfer-bad").mkdir(mode=0o700)
    numbers = tmp_path / "solfer-bad" / "bells"
    numbers.write_bytes(b"123")
    numbers.chmod(0o600)
    space = Namespace("good", tmp_path)
    for call, error, place, words in (
        (lambda: Namespace("a b", tmp_path), MiddlewareError, "", "invalid namespace name 'a b'"),
        (lambda: Namespace("bad", tmp_path), MiddlewareError, str(numbers), "solfer's notifications: 3 bytes"),
        (
            lambda: Namespace("bat", tmp_path, make=False),
            UnknownName,
            str(tmp_path),
            "namespace 'bat' (did you mean bad?)",
        ),
        (lambda: space.path("x" * 241), MiddlewareError, "", "letters is too long for shared memory"),
    ):
        check_refusal(call, error, place, words)
    assert not (tmp_path / "solfer-bat").exists()
    assert space.place("topics", "a/b").parent.is_dir()
    assert space.path("x" * 240).name == "x" * 240


def test_a_lost_process_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(presence.Presence, "PERIOD", 0.0)
    space = Namespace("robot", tmp_path)
    here = Presence(space, [segment := Segment.create(space.place("estop"), KIND, LAYOUT, 8)])
    here.require()
    assert not here.lost() and here.loss == ""
    segment.path.unlink()
    assert here.lost()
    assert str(segment.path) in here.loss
    check_refusal(here.require, MiddlewareError, "", f"no other process finds this one any more: {here.loss}")


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
    words = f"{text.size + 1} bytes do not fit into shared memory (expected: at most {text.size})"
    check_refusal(lambda: text.write(longest + b"x"), MiddlewareError, "", words)
    assert text.read() == longest[:-1]

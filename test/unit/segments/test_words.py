"""Words in shared memory: the protocols that use them hold under every order that ARM permits.

The programs of writer and reader are not written down here but recorded from the code: what `Slots.put`, `Slots._fetch`
and the kernel `append` read, write and fence, in their order. The tests explore all orders in which a processor may
carry them out. Two accesses stay in order only if they are of one place, or a fence between them says so. Nothing else
counts, not even that one access needs the number that another one reads: so ARM allows fewer orders than are explored.
"""

from types import SimpleNamespace
from typing import NamedTuple

import pytest
from support.unit.assembly import assembly_for
from support.unit.refusals import check_refusal
from support.unit.writers import KIND, LAYOUT

from solfer.errors import MiddlewareError
from solfer.numerics import fences
from solfer.segments import words as words_module
from solfer.segments.header import CACHE_LINE
from solfer.segments.ring import Ring
from solfer.segments.segment import Segment
from solfer.segments.slot import NEWEST, STAMP_WORD, STATE_WORD, TAKEN, Slot
from solfer.segments.words import FENCED, IN_ORDER, FencedWords, words_of
from solfer.telemetry import kernel

ACQUIRE, RELEASE = "acquire", "release"
LOAD, STORE = "load", "store"
COUNT = 2
"""Slots."""
WIDTH = 2
"""Numbers of a record."""
STRIDE = CACHE_LINE // 8 * 2
"""Words from one slot to the next."""


class Step(NamedTuple):
    """A load, store or fence; `value` is what a store writes."""

    kind: str
    place: int = -1
    value: int = 0


class Memory:
    """Words that note each access, in front of memory that does what is needed for the code to go on."""

    def __init__(self, steps, first, words):
        self._steps = steps
        self._first = first
        self._words = words

    def __len__(self):
        return len(self._words)

    def __getitem__(self, place):
        self._steps.append(Step(LOAD, self._first + place))
        return self._words[place]

    def __setitem__(self, place, value):
        if isinstance(place, slice):  # all numbers of a record
            for index, number in enumerate(value):
                self[index] = number
            return
        self._steps.append(Step(STORE, self._first + place, int(value)))
        self._words[place] = value


class Copy(list):
    """A reader's private copy: to fill it reads the record."""

    def __setitem__(self, place, record):
        super().__setitem__(place, [record[index] for index in range(len(record))])


def fenced(monkeypatch, steps, words):
    """Return words of ARM over other ones, of which the fences are noted."""
    monkeypatch.setattr(fences, "acquire", lambda: steps.append(Step(ACQUIRE)))
    monkeypatch.setattr(fences, "release", lambda: steps.append(Step(RELEASE)))
    return FencedWords(words)


def traced(monkeypatch, end):
    """Let an end of shared memory note its steps; returns these."""
    steps = []
    end.words = fenced(monkeypatch, steps, Memory(steps, 0, end.words))
    end._records = [
        Memory(steps, (2 * CACHE_LINE) // 8 + index * STRIDE, record) for index, record in enumerate(end._records)
    ]
    end._copy = Copy()
    end._content = end.values  # not seen by others
    return steps


def record_put(monkeypatch, numbers):
    """Record the steps of `Slots.put` for some records, of which stamp and numbers are the number of the record."""
    ring = Ring(memoryview(bytearray(Ring.size(WIDTH, COUNT))), WIDTH, COUNT)
    steps = traced(monkeypatch, ring)
    for number in numbers:
        ring.values[:] = number
        ring.sequence = number - 1
        ring.put(number)
    return steps


def record_append(monkeypatch, numbers):
    """Record the steps of the kernel that writes rows."""
    steps = []
    words = Memory(steps, 0, [0] * (Ring.size(WIDTH, COUNT) // 8))
    ring = SimpleNamespace(
        words=words, count=COUNT, stride=STRIDE, number=[0], pieces=1, arrays=[0], sizes=[WIDTH]
    )  # fmt: skip
    monkeypatch.setattr(kernel, "_ring_at", lambda _: ring)
    monkeypatch.setattr(kernel, "release_fence", lambda: steps.append(Step(RELEASE)))
    for number in numbers:
        monkeypatch.setattr(kernel, "indices_at", lambda *_, number=number: [number] * WIDTH)
        ring.number[0] = number - 1
        kernel._append(0, number)
    return steps


def record_read(monkeypatch, number, refuse=False):
    """Record the steps of a reader that finds the index at `number`, and accepts that record."""
    memory = memoryview(bytearray(Ring.size(WIDTH, COUNT)))
    writer = Ring(memory, WIDTH, COUNT)
    for _ in range(number):
        writer.put(0)
    reader = Ring(memory, WIDTH, COUNT, refuse) if refuse else Slot(memory, WIDTH, COUNT)
    reader.sequence = number - 1
    steps = traced(monkeypatch, reader)
    assert reader.read()
    return steps


def order(steps):
    """Return the accesses of a program, and of each the mask of those that it waits for."""
    accesses = [(index, step) for index, step in enumerate(steps) if step.kind in (LOAD, STORE)]
    waits = []
    for later, (end, after) in enumerate(accesses):
        mask = 0
        for earlier, (begin, before) in enumerate(accesses[:later]):
            between = {step.kind for step in steps[begin:end]}
            if (
                before.place == after.place
                or (RELEASE in between and after.kind == STORE)
                or (ACQUIRE in between and before.kind == LOAD)
            ):
                mask |= 1 << earlier
        waits.append(mask)
    return [step for _, step in accesses], waits


def explore(writer, reader):
    """Return, for each order in which both may be carried out, what each load of the reader has read.

    Loads of the writer read nothing that matters, stores of the reader neither.
    """
    writes, write_waits = order(writer)
    reads, read_waits = order(reader)
    content = {}

    def memory(done):
        if done not in content:  # stores to one place are in order
            content[done] = {step.place: step.value for index, step in enumerate(writes) if done >> index & 1}
        return content[done]

    begin = (0, 0, (None,) * len(reads))
    seen = {begin}
    waiting = [begin]
    results = set()
    while waiting:
        written, read, values = waiting.pop()
        following = [
            (written | 1 << index, read, values)
            for index, mask in enumerate(write_waits)
            if not written >> index & 1 and mask & written == mask
        ]
        for index, (step, mask) in enumerate(zip(reads, read_waits, strict=True)):
            if not read >> index & 1 and mask & read == mask:
                value = memory(written).get(step.place, 0)
                following.append((written, read | 1 << index, (*values[:index], value, *values[index + 1 :])))
        if read == (1 << len(reads)) - 1:
            results.add(values)
        else:
            new = [state for state in following if state not in seen]
            seen.update(new)
            waiting += new
    return reads, results


def faults(writer, reader, number):
    """Find what may go wrong for a reader of the record `number`."""
    reads, results = explore(writer, reader)
    place = CACHE_LINE // 8 + number % COUNT * STRIDE
    found = set()
    for values in results:
        index, *rest = [value for step, value in zip(reads, values, strict=True) if step.place == NEWEST]
        marks = [value for step, value in zip(reads, values, strict=True) if step.place == place + STATE_WORD]
        others = {
            value
            for step, value in zip(reads, values, strict=True)
            if step.kind == LOAD and step.place > place + STATE_WORD
        }
        assert not rest and len(marks) == 2
        if index < number:
            continue  # nobody reads a record that the index does not announce
        if min(marks) < 2 * number:
            found.add("older than the index")
        if marks == [2 * number] * 2 and others != {number}:
            found.add("torn")
    return found


WRITERS = {"slot": record_put, "kernel": record_append}


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("name", WRITERS)
def test_no_order_tears_a_record(monkeypatch, name, number):
    """Three records in two slots: the third overwrites the first."""
    assert not faults(WRITERS[name](monkeypatch, (1, 2, 3)), record_read(monkeypatch, number), number)


def without(steps, fence, period):
    """Return a program without one fence, in each of its rounds of so many steps."""
    return [step for index, step in enumerate(steps) if index % period != fence]


def test_each_fence_of_the_kernel_is_needed(monkeypatch):
    assert needed_by_writer(monkeypatch, "kernel") == {"stamp": True, "newest": True}


def test_words_have_the_fences_that_are_needed(monkeypatch):
    """The others come with the rule: who goes by the index needs no order of numbers and marks."""
    needed = {"unfinished": False, "stamp": True, "finished": False, "newest": True}
    assert needed_by_writer(monkeypatch, "slot") == needed
    writer = record_put(monkeypatch, (1, 2, 3))
    readers = {number: record_read(monkeypatch, number) for number in (1, 2, 3)}
    fences_of_reader = [index for index, step in enumerate(readers[1]) if step.kind == ACQUIRE]
    needed = [
        any(faults(writer, without(steps, fence, len(steps)), number) for number, steps in readers.items())
        for fence in fences_of_reader
    ]
    assert dict(zip(("newest", "first look", "stamp", "second look"), needed, strict=True)) == {
        "newest": True,
        "first look": False,
        "stamp": True,
        "second look": False,
    }


def needed_by_writer(monkeypatch, name):
    """Return, for the word behind each fence, whether a fault appears without it."""
    steps = WRITERS[name](monkeypatch, (1, 2, 3))
    period = len(steps) // 3
    readers = {number: record_read(monkeypatch, number) for number in (1, 2, 3)}
    place = CACHE_LINE // 8 + 1 % COUNT * STRIDE
    names = {
        Step(STORE, place + STATE_WORD, 1): "unfinished",
        Step(STORE, place + STAMP_WORD, 1): "stamp",
        Step(STORE, place + STATE_WORD, 2): "finished",
        Step(STORE, NEWEST, 1): "newest",
    }
    return {
        names[steps[fence + 1]]: any(
            faults(without(steps, fence, period), reader, number) for number, reader in readers.items()
        )
        for fence in range(period)
        if steps[fence].kind == RELEASE
    }


def test_a_place_is_free_once_its_record_was_read(monkeypatch):
    """The reader of a ring that refuses hands back a place: its writes wait for all reads of the record."""
    accesses, waits = order(record_read(monkeypatch, 1, refuse=True))
    last = len(accesses) - 1
    assert accesses[last] == Step(STORE, TAKEN, 1)
    assert waits[last] == (1 << last) - 1
    writer = Ring(memoryview(bytearray(Ring.size(WIDTH, COUNT))), WIDTH, COUNT, refuse=True)
    steps = traced(monkeypatch, writer)
    writer.write(1)
    accesses, waits = order(steps)
    assert accesses[0] == Step(LOAD, TAKEN)
    assert all(mask & 1 for mask in waits[1:])


@pytest.fixture(autouse=True)
def x86(monkeypatch):
    """Use the words of x86, which note nothing, on every processor."""
    monkeypatch.setattr(words_module, "_machine", lambda: IN_ORDER[0])


@pytest.fixture
def arm(monkeypatch):
    """Use the words of ARM, of which the fences do no harm elsewhere."""
    monkeypatch.setattr(words_module, "_machine", lambda: FENCED[0])


def test_x86_reads_memory_itself():
    """A cycle pays nothing for other processors."""
    assert isinstance(words_of(memoryview(bytearray(8))), memoryview)


def test_records_pass_words_with_fences(arm):
    memory = memoryview(bytearray(Slot.size(3)))
    writer, reader = Slot(memory, 3), Slot(memory, 3)
    for number in (1, 2, 3):
        writer.values[:] = number
        writer.write(10 * number)
        assert reader.read()
        assert (reader.sequence, reader.stamp, reader.values.tolist()) == (number, 10 * number, [number] * 3)
    assert isinstance(reader.words, FencedWords)


def test_a_segment_is_retired_by_words_with_fences(arm, tmp_path):
    owner = Segment.create(tmp_path / "pipe", KIND, LAYOUT, 8)
    reader = Segment.attach(tmp_path / "pipe", KIND, LAYOUT)
    owner.beat(123)
    assert (reader.heartbeat, reader.retired) == (123, False)
    owner.close()
    assert reader.retired


def test_a_processor_of_unknown_order_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(words_module, "_machine", lambda: "riscv64")
    words = (
        "not safe on a riscv64: it may reorder reads and writes (expected: one of x86_64, amd64, i686, i386, aarch64,"
    )
    for open_segment in (
        lambda: Segment.create(tmp_path / "pipe", KIND, LAYOUT, 8),
        lambda: Segment.attach(tmp_path / "pipe", KIND),
    ):
        check_refusal(open_segment, MiddlewareError, "", words)


@pytest.mark.parametrize(("function", "barrier"), [(fences._acquire, "ishld"), (fences._release, "ish")])
def test_a_fence_is_a_barrier_of_arm(function, barrier):
    instructions = assembly_for(function, "void()")
    assert [each for each in instructions if each.startswith("dmb")] == [f"dmb {barrier}"]


def test_the_kernel_has_its_barriers_on_arm():
    """The compiler moves no write across them."""
    instructions = assembly_for(kernel._append, "void(int64, int64)")
    writes = [each for each in instructions if each.startswith(("dmb", "st", "ret")) and "[sp" not in each]
    first, second = (index for index, each in enumerate(writes) if each == "dmb ish")
    assert first == 1  # the mark
    assert second - first > 3  # the stamp, the numbers, and the mark again
    assert writes.index("ret") - second == 4  # the index, and, seen by nobody else, the row's number and the status

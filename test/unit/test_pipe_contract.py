"""What every pipe of every middleware does; here in memory and shared memory, in test/ros/contract_test.py on ROS."""

import logging

import numpy as np
import pytest
from contract import ALL, NAMED
from numpy.testing import assert_allclose
from wires import MemoryWire, XbotWire

from solfer.pipes import Status

every_pipe = pytest.mark.parametrize("case", ALL.values(), ids=ALL)
pipes_with_names = pytest.mark.parametrize("case", NAMED.values(), ids=NAMED)


WIRES = {"memory": MemoryWire, "xbot": XbotWire}


def pytest_generate_tests(metafunc):
    """Every test for every middleware; that of ROS is handed over by the rostest."""
    if "wire" in metafunc.fixturenames:
        wires = {"ros": metafunc.config.wire} if hasattr(metafunc.config, "wire") else WIRES
        metafunc.parametrize("wire", wires.values(), ids=wires, indirect=True)


@pytest.fixture
def wire(request):
    """A middleware."""
    wire = request.param()
    yield wire
    wire.close()


@pytest.fixture
def said():
    """What was logged from now on."""
    lines = []

    class Handler(logging.Handler):
        def emit(self, record):
            lines.append(record.getMessage())

    handler = Handler()
    logging.getLogger("solfer").addHandler(handler)
    yield lines
    logging.getLogger("solfer").removeHandler(handler)


def numbers(case, seed):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, case.size)


def start(wire, case):
    """A feedback that has heard a first message: the topic, its end, and the numbers."""
    topic, first = wire.topic(), numbers(case, 1)
    end = case.listen(wire, topic)
    wire.say("speaker", topic, case.kind, case.message(first))
    wire.until(lambda: end.pipe.run() is Status.NEW)
    assert_allclose(end.numbers, first, atol=1e-12)
    return topic, end, first


@every_pipe
def test_round_trip(wire, case):
    topic = wire.topic()
    ear, mouth = case.listen(wire, topic), case.tell(wire, topic)
    assert ear.pipe.run() is Status.NONE and not ear.pipe.heard
    for seed in range(3):
        mouth.numbers[:] = numbers(case, seed)

        def arrives(mouth=mouth):
            mouth.pipe.collect()
            mouth.pipe.send(0.5)
            return ear.pipe.run() is Status.NEW and np.allclose(ear.numbers, mouth.numbers, atol=1e-12)

        wire.until(arrives)
    assert ear.pipe.heard and ear.pipe.refused == 0
    assert ear.pipe.reader.message.sender == wire.middleware.name


@every_pipe
def test_the_newest_message_counts_and_none_comes_back(wire, case):
    topic, end, first = start(wire, case)
    series = [first * (1.0 - 0.01 * index) for index in range(1, 51)]
    wire.say("speaker", topic, case.kind, *map(case.message, series))
    seen = []

    def all_seen():
        if end.pipe.run() is Status.NEW:
            seen.append(np.linalg.norm(end.numbers))
        return np.allclose(end.numbers, series[-1], atol=1e-12)

    wire.until(all_seen)
    assert seen == sorted(seen, reverse=True)
    wire.pass_time(0.1)
    assert end.pipe.run() is Status.OLD
    assert_allclose(end.numbers, series[-1], atol=1e-12)


@every_pipe
def test_every_message_comes_in_its_order(wire, case):
    topic = wire.topic()
    queue = wire.middleware.queue(topic, case.kind, 100)
    marks = [numbers(case, 2) * (1.0 - 0.01 * index) for index in range(50)]
    wire.say("speaker", topic, case.kind, *map(case.message, marks))
    messages = []
    wire.until(lambda: messages.extend(queue.drain()) or len(messages) == 50)
    for message, mark in zip(messages, marks, strict=True):
        expected = case.message(mark)
        for field, value in vars(expected).items():
            if isinstance(value, np.ndarray):
                assert_allclose(getattr(message, field), value, atol=0.0)


@every_pipe
def test_ages(wire, case):
    topic = wire.topic()
    end = case.listen(wire, topic)
    assert end.pipe.reader.age() == np.inf and end.pipe.arrival == np.inf
    wire.say("speaker", topic, case.kind, case.message(numbers(case, 1)))
    wire.until(lambda: end.pipe.run() is Status.NEW)
    first = end.pipe.arrival
    assert 0.0 <= wire.middleware.now() - first < 30.0
    wire.pass_time(0.3)
    assert end.pipe.run() is Status.OLD
    assert end.pipe.reader.age() >= 0.3 and end.pipe.arrival == first
    wire.say("speaker", topic, case.kind, case.message(numbers(case, 2)))
    wire.until(lambda: end.pipe.run() is Status.NEW)
    assert end.pipe.arrival >= first + 0.3


def refuses(wire, case, message, said, text):
    """The pipe refuses a message, keeps what it has, names the sender, and takes the next good one."""
    topic, end, first = start(wire, case)
    arrival = end.pipe.arrival
    wire.pass_time(0.01)
    wire.say("stranger", topic, case.kind, message)
    wire.until(lambda: end.pipe.run() is not Status.NEW and end.pipe.refused)
    assert_allclose(end.numbers, first, atol=1e-12)
    assert (end.pipe.accepted, end.pipe.refused, end.pipe.arrival) == (1, 1, arrival)
    assert any(text in line and "stranger" in line for line in said), said
    wire.say("speaker", topic, case.kind, case.message(numbers(case, 3)))
    wire.until(lambda: end.pipe.run() is Status.NEW)
    assert_allclose(end.numbers, numbers(case, 3), atol=1e-12)


@every_pipe
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused(wire, case, value, said):
    wanted = numbers(case, 2)
    wanted[0] = value
    refuses(wire, case, case.message(wanted), said, "finite")


@every_pipe
def test_what_nobody_knows_is_refused(wire, case, said):
    message, text = case.unknown()
    refuses(wire, case, message, said, text)


@pipes_with_names
def test_a_name_that_stands_twice_is_refused(wire, case, said):
    names = (*case.names[:-1], case.names[0])
    refuses(wire, case, case.message(numbers(case, 2), names), said, f"stand twice in it: {case.names[0]}")


@pipes_with_names
def test_a_wrong_size_is_refused(wire, case, said):
    refuses(wire, case, case.longer(), said, "numbers")


@pipes_with_names
def test_names_count_and_not_their_order(wire, case):
    topic, end, _ = start(wire, case)
    given = numbers(case, 4)
    turned = given.reshape(len(case.names), -1)[::-1].ravel()
    for names, values in ((case.names[::-1], turned), (case.names, given)):
        wire.say("speaker", topic, case.kind, case.message(values, names))
        wire.until(lambda: end.pipe.run() is Status.NEW)
        assert_allclose(end.numbers, given, atol=1e-12)


@pipes_with_names
def test_what_a_sender_lacks_keeps_its_value(wire, case):
    topic, end, first = start(wire, case)
    given = numbers(case, 5).reshape(len(case.names), -1)
    wire.say("speaker", topic, case.kind, case.message(given[-1], case.names[-1:]))
    wire.until(lambda: end.pipe.run() is Status.NEW)
    kept = first.reshape(len(case.names), -1)
    assert_allclose(end.numbers.reshape(kept.shape), [*kept[:-1], given[-1]], atol=1e-12)


@pipes_with_names
def test_a_pipe_is_heard_when_each_of_its_names_is(wire, case):
    topic = wire.topic()
    end = case.listen(wire, topic)
    given = numbers(case, 5).reshape(len(case.names), -1)
    for index, name in enumerate(case.names):
        assert not end.pipe.heard and (index == 0 or name in end.pipe.lacks)
        wire.say("speaker", topic, case.kind, case.message(given[index], (name,)))
        wire.until(lambda: end.pipe.run() is Status.NEW)
    assert end.pipe.heard
    assert_allclose(end.numbers, given.ravel(), atol=1e-12)


@every_pipe
def test_a_sender_that_is_started_again_goes_on(wire, case):
    topic, end, first = start(wire, case)
    wire.kill("speaker")
    wire.pass_time(0.1)
    assert end.pipe.run() is Status.OLD
    assert_allclose(end.numbers, first, atol=1e-12)
    wire.say("speaker", topic, case.kind, case.message(numbers(case, 6)))
    wire.until(lambda: end.pipe.run() is Status.NEW)
    assert_allclose(end.numbers, numbers(case, 6), atol=1e-12)
    assert end.pipe.refused == 0


@every_pipe
def test_of_two_senders_the_newest_message_counts_and_both_are_named(wire, case, said):
    topic, end, _ = start(wire, case)
    for seed in range(10, 14):
        for sender in ("speaker", "second"):
            wire.say(sender, topic, case.kind, case.message(numbers(case, seed)))
            wire.until(lambda: end.pipe.run() is Status.NEW)
            assert_allclose(end.numbers, numbers(case, seed), atol=1e-12)
            assert end.pipe.reader.message.sender.lstrip("/") == sender
    told = [line for line in said if "speak on" in line]
    assert told and "second" in told[0] and "speaker" in told[0] and topic in told[0]

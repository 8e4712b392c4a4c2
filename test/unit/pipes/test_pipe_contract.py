"""The contract of every pipe of every middleware; test/ros/contract_test.py runs it on ROS."""

import logging

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.unit.contract import ALL, MEASURED, NAMED, keeping
from support.unit.wires import ROS2, MemoryWire, XbotWire

from solfer.transport import MessageStatus

every_pipe = pytest.mark.parametrize("case", ALL.values(), ids=ALL)
pipes_with_names = pytest.mark.parametrize("case", NAMED.values(), ids=NAMED)


WIRES = {"memory": MemoryWire, "xbot": XbotWire, **ROS2}


def pytest_generate_tests(metafunc):
    """Run every test for every middleware; the rostest passes that of ROS."""
    if "wire" in metafunc.fixturenames:
        wires = {"ros": metafunc.config.wire} if hasattr(metafunc.config, "wire") else WIRES
        metafunc.parametrize("wire", wires.values(), ids=wires, indirect=True)


@pytest.fixture
def wire(request):
    """Open a middleware."""
    wire = request.param()
    yield wire
    wire.close()


@pytest.fixture
def logged():
    """Collect the log from now on."""
    lines = []

    class Handler(logging.Handler):
        def emit(self, record):
            lines.append(record.getMessage())

    handler = Handler()
    logging.getLogger("solfer").addHandler(handler)
    yield lines
    logging.getLogger("solfer").removeHandler(handler)


def numbers(case, seed):
    """Draw numbers of a message; a body tilts no more than one can between two messages."""
    drawn = np.random.default_rng(seed).uniform(-1.0, 1.0, case.size)
    if case is ALL["operational"]:
        drawn[3:5] *= 0.03
    return drawn


def start(wire, case):
    """Make a feedback that has received a first message; return the topic, its end, and the numbers."""
    topic, first = wire.topic(), numbers(case, 1)
    end = case.listen(wire, topic)
    wire.say("first", topic, case.kind, case.message(first))
    wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
    assert_allclose(end.numbers, first, atol=1e-12)
    return topic, end, first


@every_pipe
def test_round_trip(wire, case):
    """Numbers survive every middleware and message to 1e-12, and the sender's name arrives with them."""
    topic = wire.topic()
    receiver, sender = case.listen(wire, topic), case.publish(wire, topic)
    assert receiver.pipe.run() is MessageStatus.NONE and not receiver.pipe.received
    for seed in range(3):
        sender.numbers[:] = numbers(case, seed)

        def arrives():
            sender.pipe.collect()
            sender.pipe.send(0.5)
            return receiver.pipe.run() is MessageStatus.NEW and np.allclose(
                receiver.numbers, sender.numbers, atol=1e-12
            )

        wire.until(arrives)
    assert receiver.pipe.received and receiver.pipe.refused == 0
    assert receiver.pipe.reader.message.sender == wire.middleware.name


@every_pipe
def test_the_newest_message_counts(wire, case):
    """Fifty messages come at once: none is taken after a later one, and the last keeps its values when old."""
    topic, end, first = start(wire, case)
    series = [first * (1.0 - 0.01 * index) for index in range(1, 51)]
    wire.say("first", topic, case.kind, *map(case.message, series))
    seen = []

    def all_seen():
        if end.pipe.run() is MessageStatus.NEW:
            seen.append(np.linalg.norm(end.numbers))
        return np.allclose(end.numbers, series[-1], atol=1e-12)

    wire.until(all_seen)
    assert seen == sorted(seen, reverse=True)
    wire.pass_time(0.1)
    assert end.pipe.run() is MessageStatus.OLD
    assert_allclose(end.numbers, series[-1], atol=1e-12)


@every_pipe
def test_messages_are_queued_in_order(wire, case):
    topic = wire.topic()
    queue = wire.middleware.queue(topic, case.kind, 100)
    marks = [numbers(case, 2) * (1.0 - 0.01 * index) for index in range(50)]
    wire.say("first", topic, case.kind, *map(case.message, marks))
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
    wire.say("first", topic, case.kind, case.message(numbers(case, 1)))
    wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
    first = end.pipe.arrival
    assert 0.0 <= wire.middleware.now() - first < 30.0
    wire.pass_time(0.3)
    assert end.pipe.run() is MessageStatus.OLD
    assert end.pipe.reader.age() >= 0.3 and end.pipe.arrival == first
    wire.say("first", topic, case.kind, case.message(numbers(case, 2)))
    wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
    assert end.pipe.arrival >= first + 0.3


def refuses(wire, case, message, logged, text):
    """Check that the pipe refuses a message, keeps its values, names the sender, and accepts the next good one."""
    topic, end, first = start(wire, case)
    arrival = end.pipe.arrival
    wire.pass_time(0.01)
    wire.say("stranger", topic, case.kind, message)
    wire.until(lambda: end.pipe.run() is not MessageStatus.NEW and end.pipe.refused)
    assert_allclose(end.numbers, first, atol=1e-12)
    assert (end.pipe.accepted, end.pipe.refused, end.pipe.arrival) == (1, 1, arrival)
    assert any(text in line and "stranger" in line for line in logged), logged
    wire.say("first", topic, case.kind, case.message(numbers(case, 3)))
    wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
    assert_allclose(end.numbers, numbers(case, 3), atol=1e-12)


@every_pipe
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_nan_or_infinity_is_refused(wire, case, value, logged):
    values = numbers(case, 2)
    values[0] = value
    refuses(wire, case, case.message(values), logged, "finite")


@every_pipe
def test_an_unknown_name_or_frame_is_refused(wire, case, logged):
    message, text = case.unknown()
    refuses(wire, case, message, logged, text)


@pipes_with_names
def test_a_repeated_name_is_refused(wire, case, logged):
    names = (*case.names[:-1], case.names[0])
    refuses(wire, case, case.message(numbers(case, 2), names), logged, f"twice: {case.names[0]}")


@pipes_with_names
def test_a_wrong_size_is_refused(wire, case, logged):
    refuses(wire, case, case.longer(), logged, "numbers")


@pipes_with_names
def test_values_are_mapped_by_name(wire, case):
    topic, end, _ = start(wire, case)
    given = numbers(case, 4)
    turned = given.reshape(len(case.names), -1)[::-1].ravel()
    for names, values in ((case.names[::-1], turned), (case.names, given)):
        wire.say("first", topic, case.kind, case.message(values, names))
        wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
        assert_allclose(end.numbers, given, atol=1e-12)


@pipes_with_names
def test_missing_names_keep_their_values(wire, case):
    topic, end, first = start(wire, case)
    given = numbers(case, 5).reshape(len(case.names), -1)
    wire.say("first", topic, case.kind, case.message(given[-1], case.names[-1:]))
    wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
    kept = first.reshape(len(case.names), -1)
    assert_allclose(end.numbers.reshape(kept.shape), [*kept[:-1], given[-1]], atol=1e-12)


@pipes_with_names
def test_a_pipe_is_received_with_its_last_name(wire, case):
    topic = wire.topic()
    end = case.listen(wire, topic)
    given = numbers(case, 5).reshape(len(case.names), -1)
    for index, name in enumerate(case.names):
        assert not end.pipe.received and (index == 0 or name in end.pipe.lacks)
        wire.say("first", topic, case.kind, case.message(given[index], (name,)))
        wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
    assert end.pipe.received
    assert_allclose(end.numbers, given.ravel(), atol=1e-12)


@every_pipe
def test_a_restarted_sender_is_received_again(wire, case):
    topic, end, first = start(wire, case)
    wire.kill("first")
    wire.pass_time(0.1)
    assert end.pipe.run() is MessageStatus.OLD
    assert_allclose(end.numbers, first, atol=1e-12)
    wire.say("first", topic, case.kind, case.message(numbers(case, 6)))
    wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
    assert_allclose(end.numbers, numbers(case, 6), atol=1e-12)
    assert end.pipe.refused == 0


@pytest.mark.parametrize(
    "case",
    [case for name, case in ALL.items() if name not in MEASURED],
    ids=[name for name in ALL if name not in MEASURED],
)
def test_the_newest_of_two_senders_counts(wire, case, logged):
    topic, end, _ = start(wire, case)
    for seed in range(10, 14):
        for sender in ("first", "second"):
            wire.say(sender, topic, case.kind, case.message(numbers(case, seed)))
            wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
            assert_allclose(end.numbers, numbers(case, seed), atol=1e-12)
            assert end.pipe.reader.message.sender.lstrip("/") == sender
    published = [line for line in logged if "publish on" in line]
    assert published and "second" in published[0] and "first" in published[0] and topic in published[0]


@pytest.mark.parametrize("case", MEASURED.values(), ids=MEASURED)
def test_the_first_of_two_measurements_counts(wire, case, logged):
    topic, end, first = start(wire, case)
    for seed in range(10, 14):
        ignored = end.pipe.ignored
        wire.say("second", topic, case.kind, case.message(numbers(case, seed)))
        wire.until(lambda ignored=ignored: end.pipe.run() is not MessageStatus.NEW and end.pipe.ignored > ignored)
        assert_allclose(end.numbers, first, atol=1e-12)
    published = end.pipe.conflict(wire.middleware.now())
    assert all(part in published for part in ("'pipe'", topic, "second", "first", "end one of them")), published
    assert any("second were ignored" in line for line in logged), logged
    wire.say("first", topic, case.kind, case.message(numbers(case, 20)))
    wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
    assert_allclose(end.numbers, numbers(case, 20), atol=1e-12)
    assert end.pipe.handovers == 0 and end.pipe.refused == 0


@pytest.mark.parametrize("case", MEASURED.values(), ids=MEASURED)
def test_of_two_measurements_the_firsts_newest_is_kept(wire, case):
    topic, end, _ = start(wire, case)
    wire.say("first", topic, case.kind, case.message(numbers(case, 5)))
    wire.say("second", topic, case.kind, *(case.message(numbers(case, seed)) for seed in range(10, 14)))
    wire.until(lambda: end.pipe.run() is MessageStatus.NEW)
    assert_allclose(end.numbers, numbers(case, 5), atol=1e-12)


@pytest.mark.parametrize("case", MEASURED.values(), ids=MEASURED)
def test_the_second_takes_over_after_a_timeout(wire, case):
    topic, end, _ = start(wire, case)
    end.pipe.set_timeout(0.2, 3)
    wire.kill("first")

    def goes_over():
        wire.say("second", topic, case.kind, case.message(numbers(case, 10)))
        wire.pass_time(0.01)
        end.pipe.run()
        return end.pipe.handovers == 1

    wire.until(goes_over)
    assert end.pipe.ignored >= 2  # the strikes before
    assert_allclose(end.numbers, numbers(case, 10), atol=1e-12)


class Histories:
    """A feedback that hands over every message, of at most eight in a cycle."""

    def __init__(self, wire, case):
        self.wire, self.case, self.topic = wire, case, wire.topic()
        self.pipe = keeping(case, 8).listen(wire, self.topic).pipe
        self.history = self.pipe.history
        self._queue, self._stamps = wire.middleware.queue(self.topic, case.kind, 100), {}

    def arrive(self, sender, *messages):
        """Publish messages, and wait until all have arrived; under ROS they are stamped as they are sent."""
        arrived = []
        self.wire.say(sender, self.topic, self.case.kind, *messages)
        self.wire.until(lambda: arrived.extend(self._queue.drain()) or len(arrived) == len(messages))
        self._stamps |= {sent.stamp: each.stamp for sent, each in zip(messages, arrived, strict=True)}

    def series(self, first, count):
        """Return messages with other numbers and stamps each."""
        messages = []
        for seed in range(first, first + count):
            messages.append(self.case.message(numbers(self.case, seed)))
            messages[-1].stamp = 10.0 + 0.002 * seed
        return messages

    def holds(self, *seeds):
        """Check the messages of a cycle, and that they are in the order of their arrival."""
        history = self.history
        assert history.count == len(seeds)
        expected = [[numbers(self.case, seed)] for seed in seeds]
        assert_allclose(history.values[: history.count], expected, atol=1e-9)
        stamps = [self._stamps[10.0 + 0.002 * seed] for seed in seeds]
        assert history.stamps[: history.count].tolist() == stamps == sorted(set(stamps))
        assert (np.diff(history.arrivals[: history.count]) >= 0.0).all()


measured_pipes = pytest.mark.parametrize("case", MEASURED.values(), ids=MEASURED)


@measured_pipes
def test_every_message_since_the_last_cycle_is_handed_over(wire, case):
    end = Histories(wire, case)
    assert end.pipe.run() is MessageStatus.NONE and end.history.count == 0
    for first in (10, 20, 30):
        end.arrive("first", *end.series(first, 5))
        assert end.pipe.run() is MessageStatus.NEW
        end.holds(*range(first, first + 5))
        (history,), state = end.pipe._state.histories, end.pipe._state
        assert history is end.history and history.interfaces == ("position",)
        assert_allclose(state.position[history.dofs], numbers(case, first + 4), atol=1e-9)
        assert end.pipe.run() is MessageStatus.OLD and end.history.count == 0
    assert (end.pipe.accepted, end.pipe.dropped) == (15, 0)


@measured_pipes
def test_of_too_many_messages_the_oldest_are_dropped_and_counted(wire, case):
    end = Histories(wire, case)
    for first, dropped in ((10, 12), (30, 24)):
        end.arrive("first", *end.series(first, 20))
        assert end.pipe.run() is MessageStatus.NEW
        end.holds(*range(first + 12, first + 20))
        assert end.pipe.dropped == dropped


@measured_pipes
def test_a_history_lacks_messages_that_are_refused(wire, case):
    end = Histories(wire, case)
    wrong = numbers(case, 11)
    wrong[0] = np.nan
    before, _, after = end.series(10, 3)
    refused = case.message(wrong)
    refused.stamp = 10.022
    end.arrive("first", before, refused, after)
    assert end.pipe.run() is MessageStatus.NEW
    end.holds(10, 12)
    assert end.pipe.refused == 1


@measured_pipes
def test_a_history_is_of_the_publisher_that_counts(wire, case):
    end = Histories(wire, case)
    end.arrive("first", *end.series(10, 2))
    end.arrive("second", *end.series(20, 2))
    end.arrive("first", *end.series(12, 2))
    assert end.pipe.run() is MessageStatus.NEW
    end.holds(10, 11, 12, 13)
    assert end.pipe.ignored == 2 and end.pipe.handovers == 0


@measured_pipes
def test_a_restart_empties_a_history(wire, case):
    end = Histories(wire, case)
    end.arrive("first", *end.series(10, 3))
    end.pipe.run()
    end.pipe.restart()
    assert end.history.count == 0
    end.arrive("first", *end.series(20, 2))
    assert end.pipe.run() is MessageStatus.NEW
    end.holds(20, 21)


def test_publishers_of_different_joints_complete_each_other_in_a_history(wire):
    case = MEASURED["measurement"]
    end = Histories(wire, case)
    for value in (1.0, 2.0):
        for sender, name in zip(("first", "second"), case.names, strict=True):
            end.arrive(sender, case.message(np.array([value]), (name,)))
            wire.pass_time(0.002)
    assert end.pipe.run() is MessageStatus.NEW and end.pipe.received
    rows = end.history.values[: end.history.count, 0]
    np.testing.assert_array_equal(rows, [[1.0, np.nan], [np.nan, 1.0], [2.0, np.nan], [np.nan, 2.0]])
    assert end.pipe.part is not None and len(end.pipe.part) == 2


def test_a_history_has_what_came_before_another_order_of_names(wire):
    case = MEASURED["measurement"]
    end = Histories(wire, case)
    end.arrive("first", *end.series(10, 1))
    end.pipe.run()
    turned = end.series(13, 2)
    for message in turned:
        message.names, message.position = message.names[::-1], message.position[::-1].copy()
    end.arrive("first", *end.series(11, 2))
    end.arrive("first", *turned)
    assert end.pipe.run() is MessageStatus.NEW
    end.holds(11, 12, 13, 14)

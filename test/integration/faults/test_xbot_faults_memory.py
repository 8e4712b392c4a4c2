"""Processes on shared memory that are killed, stopped and disturbed: the others go on, and connect again."""

import logging
import os
import random
import signal
import tempfile
import time
from pathlib import Path

import pytest
from support.integration.xbot_nodes import (
    JOINT_STATE,
    JOINTS,
    NAME,
    TOPIC,
    Answer,
    Number,
    ask,
    ask_for_ever,
    node,
    publish,
    publish_second,
    serve,
    stamps,
)
from support.processes import BOUND, SPAWN, kill, process

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory import Namespace
from solfer.transport import MessageStatus


@pytest.fixture
def folder():
    with tempfile.TemporaryDirectory(dir="/dev/shm") as name:
        yield Path(name)


@pytest.fixture
def listener(folder):
    listener = node(folder, "listener")
    yield listener
    listener.close()


def pipe_file(folder, name="robot"):
    """Find the segment of a node that publishes."""
    return Namespace(NAME, folder).path("pipes", TOPIC, name)


def news(reader):
    """Read until there is something new; the number of the message."""
    end = time.monotonic() + BOUND
    while reader.read() is not MessageStatus.NEW:
        assert time.monotonic() < end, "nothing new"
        time.sleep(0.0005)
    return stamps(reader.message)


def test_a_killed_sender_is_received_when_it_returns(folder, listener):
    reader = listener.reader(TOPIC, JOINT_STATE)
    with process(publish, folder) as child:
        news(reader)
        kill(child)
        reader.read()
        last, arrival = stamps(reader.message), reader.arrival
        assert all(reader.read() is MessageStatus.OLD for _ in range(1000))
        assert stamps(reader.message) == last and reader.age() >= listener.now() - arrival - 1e-3
    with process(publish, folder):
        assert news(reader) >= 1
        assert reader.arrival > arrival and reader.refused == 0


def test_a_sender_may_come_back_with_other_joints(folder, listener):
    reader = listener.reader(TOPIC, JOINT_STATE)
    for joints in (JOINTS, JOINTS[::-1], JOINTS[:3]):
        with process(publish, folder, "robot", joints):
            news(reader)
            while reader.message.names != joints:
                news(reader)


def test_a_late_reader_ignores_a_dead_senders_message(folder, listener):
    with process(publish, folder) as child:
        kill(child)
    assert pipe_file(folder).exists()
    reader = listener.reader(TOPIC, JOINT_STATE)
    assert reader.read() is MessageStatus.NONE and reader.refused == 0


def test_killed_senders_never_leave_half_a_message(folder, listener):
    reader, chance = listener.reader(TOPIC, JOINT_STATE), random.Random(1)
    for _ in range(8):
        with process(publish, folder, "robot", JOINTS, 0.0) as child:
            end = time.monotonic() + chance.uniform(0.0, 0.05)
            received = 0
            while time.monotonic() < end or not received:
                if reader.read() is MessageStatus.NEW:
                    received = stamps(reader.message)
            kill(child)
            if reader.read() is MessageStatus.NEW:
                assert stamps(reader.message) > received


def test_a_stopped_sender_blocks_no_reader(folder, listener):
    reader = listener.reader(TOPIC, JOINT_STATE)
    with process(publish, folder) as child:
        before = news(reader)
        os.kill(child.pid, signal.SIGSTOP)
        time.sleep(0.05)
        reader.read()
        assert {reader.read() for _ in range(10000)} == {MessageStatus.OLD}
        time.sleep(0.2)
        assert reader.age() >= 0.2
        os.kill(child.pid, signal.SIGCONT)
        assert news(reader) > before


def test_of_two_writers_the_second_is_refused(folder, listener):
    reader, refusals = listener.reader(TOPIC, JOINT_STATE), SPAWN.Queue()
    with process(publish, folder) as first:
        news(reader)
        with process(publish_second, folder, refusals) as second:
            refusal = refusals.get(timeout=BOUND)
            assert f"process {first.pid} " in refusal and f"process {second.pid} " in refusal
            assert str(pipe_file(folder)) in refusal
        assert news(reader)


@pytest.mark.parametrize("content", [b"", b"not ours", b"\0" * 4096], ids=["empty", "short", "zeros"])
def test_a_foreign_file_is_named(folder, listener, content, caplog):
    reader = listener.reader(TOPIC, JOINT_STATE)
    with process(publish, folder):
        stranger = pipe_file(folder, "stranger")
        stranger.write_bytes(content)
        listener.namespace.notification("pipes", TOPIC).send()
        with caplog.at_level(logging.WARNING):
            news(reader)
            while not reader.refused:
                news(reader)
    assert str(stranger) in caplog.text
    assert stranger.read_bytes() == content


def test_a_truncated_segment_is_made_anew(folder, listener):
    with process(publish, folder) as child:
        kill(child)
    os.truncate(pipe_file(folder), 300)
    reader = listener.reader(TOPIC, JOINT_STATE)
    assert reader.read() is MessageStatus.NONE and reader.refused == 1
    with process(publish, folder):
        assert news(reader)


def test_a_killed_service_answers_when_it_returns(folder, listener):
    done = SPAWN.Queue()
    with process(serve, folder, done, True) as child:
        answer = listener.request("doubler/double", "test/Double", Number(5.0), Answer, 1.0)
        kill(child)
        while not answer.done():
            listener.sleep_until(listener.now() + 0.001)
        assert "does not answer" in str(answer.exception())
    with process(serve, folder, done):
        assert ask(listener, 6.0).number == 12.0
        assert done.get(timeout=BOUND) == 6.0  # what was given up is not carried out later


def test_a_hanging_service_fails_its_calls_in_time(folder, listener):
    with process(serve, folder, SPAWN.Queue(), True), pytest.raises(MiddlewareError, match="does not answer"):
        ask(listener, 1.0, timeout=0.5)


def test_a_killed_client_blocks_no_service(folder, listener):
    done = SPAWN.Queue()
    with process(serve, folder, done):
        for _ in range(3):
            with process(ask_for_ever, folder) as client:
                assert ask(listener, 7.0).number == 14.0
                kill(client)
            assert ask(listener, 8.0).number == 16.0
        # the next client's arrival lets the service clear away after those that were killed
        assert ask(node(folder, "other"), 9.0).number == 18.0
        calls = Namespace(NAME, folder).path("services", "doubler/double", "calls")
        assert len(list(calls.iterdir())) <= 2 * 3  # the listener's, the other's, and perhaps the last one's

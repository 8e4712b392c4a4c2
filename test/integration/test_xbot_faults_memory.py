"""Processes on shared memory that are killed, stopped and disturbed: the others go on, and hear whoever comes back."""

import logging
import os
import random
import signal
import tempfile
import time
from pathlib import Path

import pytest
from processes import BOUND, SPAWN, kill, process
from xbot_nodes import (
    JOINT_STATE,
    JOINTS,
    NAME,
    TOPIC,
    Answer,
    Number,
    ask,
    ask_for_ever,
    node,
    serve,
    speak,
    speak_second,
    stamps,
)

from solfer.errors import MiddlewareError
from solfer.middleware.xbot import Namespace
from solfer.pipes import Status


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
    """The segment in which a node speaks."""
    return Namespace(NAME, folder).path("pipes", TOPIC, name)


def news(reader):
    """Read until there is something new; the number of the message."""
    end = time.monotonic() + BOUND
    while reader.read() is not Status.NEW:
        assert time.monotonic() < end, "nothing new"
        time.sleep(0.0005)
    return stamps(reader.message)


def test_a_killed_sender_leaves_its_last_message_and_is_heard_when_it_comes_back(folder, listener):
    reader = listener.reader(TOPIC, JOINT_STATE)
    with process(speak, folder) as child:
        news(reader)
        kill(child)
        reader.read()
        last, arrival = stamps(reader.message), reader.arrival
        assert all(reader.read() is Status.OLD for _ in range(1000))
        assert stamps(reader.message) == last and reader.age() >= listener.now() - arrival - 1e-3
    with process(speak, folder):
        assert news(reader) >= 1
        assert reader.arrival > arrival and reader.refused == 0


def test_a_sender_may_come_back_with_other_joints(folder, listener):
    reader = listener.reader(TOPIC, JOINT_STATE)
    for joints in (JOINTS, JOINTS[::-1], JOINTS[:3]):
        with process(speak, folder, "robot", joints):
            news(reader)
            while reader.message.names != joints:
                news(reader)


def test_who_comes_later_does_not_take_the_message_of_a_dead_sender_for_news(folder, listener):
    with process(speak, folder) as child:
        kill(child)
    assert pipe_file(folder).exists()
    reader = listener.reader(TOPIC, JOINT_STATE)
    assert reader.read() is Status.NONE and reader.refused == 0


def test_senders_that_are_killed_at_any_moment_never_leave_half_a_message(folder, listener):
    reader, chance = listener.reader(TOPIC, JOINT_STATE), random.Random(1)
    for _ in range(8):
        with process(speak, folder, "robot", JOINTS, 0.0) as child:
            end = time.monotonic() + chance.uniform(0.0, 0.05)
            heard = 0
            while time.monotonic() < end or not heard:
                if reader.read() is Status.NEW:
                    heard = stamps(reader.message)
            kill(child)
            if reader.read() is Status.NEW:
                assert stamps(reader.message) > heard


def test_a_sender_that_stands_still_holds_up_nobody(folder, listener):
    reader = listener.reader(TOPIC, JOINT_STATE)
    with process(speak, folder) as child:
        before = news(reader)
        os.kill(child.pid, signal.SIGSTOP)
        time.sleep(0.05)
        reader.read()
        assert {reader.read() for _ in range(10000)} == {Status.OLD}
        time.sleep(0.2)
        assert reader.age() >= 0.2
        os.kill(child.pid, signal.SIGCONT)
        assert news(reader) > before


def test_of_two_writers_the_second_is_refused_with_both_numbers(folder, listener):
    reader, refusals = listener.reader(TOPIC, JOINT_STATE), SPAWN.Queue()
    with process(speak, folder) as first:
        news(reader)
        with process(speak_second, folder, refusals) as second:
            refusal = refusals.get(timeout=BOUND)
            assert f"process {first.pid} " in refusal and f"process {second.pid} " in refusal
            assert str(pipe_file(folder)) in refusal
        assert news(reader)


@pytest.mark.parametrize("content", [b"", b"not ours", b"\0" * 4096], ids=["empty", "short", "zeros"])
def test_a_foreign_file_is_named_and_the_others_are_heard(folder, listener, content, caplog):
    reader = listener.reader(TOPIC, JOINT_STATE)
    with process(speak, folder):
        stranger = pipe_file(folder, "stranger")
        stranger.write_bytes(content)
        listener.namespace.bell("pipes", TOPIC).ring()
        with caplog.at_level(logging.WARNING):
            news(reader)
            while not reader.refused:
                news(reader)
    assert str(stranger) in caplog.text
    assert stranger.read_bytes() == content


def test_a_truncated_segment_is_refused_and_made_anew_by_its_sender(folder, listener):
    with process(speak, folder) as child:
        kill(child)
    os.truncate(pipe_file(folder), 300)
    reader = listener.reader(TOPIC, JOINT_STATE)
    assert reader.read() is Status.NONE and reader.refused == 1
    with process(speak, folder):
        assert news(reader)


def test_a_killed_service_fails_its_calls_and_answers_when_it_comes_back(folder, listener):
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


def test_a_service_that_takes_calls_and_hangs_fails_them_in_time(folder, listener):
    with process(serve, folder, SPAWN.Queue(), True), pytest.raises(MiddlewareError, match="does not answer"):
        ask(listener, 1.0, timeout=0.5)


def test_a_killed_client_holds_up_neither_the_service_nor_other_clients(folder, listener):
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

"""Scheduling of the RT process by the kernel, as root and as an ordinary user."""

import gc
import os

import pytest

from solfer.realtime import schedule
from solfer.realtime.schedule import ScheduleRequest, apply

IS_ROOT = os.geteuid() == 0
NOTHING = ScheduleRequest(priority=0, lock_memory=False, timer_slack=0, cpu_latency=False, freeze_collector=False)


def test_an_empty_request_changes_nothing():
    granted = apply(NOTHING)
    assert (granted.granted, granted.refused, granted.text) == ([], [], "ordinary")


def test_the_collector_is_off_until_the_end():
    granted = apply(ScheduleRequest(priority=0, lock_memory=False, timer_slack=0, cpu_latency=False))
    assert not gc.isenabled() and granted.text == "collector frozen"
    granted.close()
    assert gc.isenabled() and gc.get_freeze_count() == 0


@pytest.mark.slow
def test_a_refusal_is_reported_and_does_no_harm(monkeypatch):
    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(schedule, "LATENCY", "/nowhere/cpu_dma_latency")
    granted = apply(ScheduleRequest(lock_memory=False))
    granted.close()
    assert granted.granted == ["collector frozen", "timer slack 1 ns"]
    assert granted.refused == ["processor latency (No such file or directory)", "FIFO 60 (Operation not permitted)"]
    assert granted.text.endswith(
        "; without processor latency (No such file or directory), FIFO 60 (Operation not permitted)"
    )


@pytest.mark.slow
@pytest.mark.skipif(not IS_ROOT, reason="needs the right to ask for SCHED_FIFO; skipped without it")
def test_root_gets_fifo_and_gives_it_back():
    granted = apply(
        ScheduleRequest(priority=7, lock_memory=False, cpu_latency=False, cpus=(min(os.sched_getaffinity(0)),))
    )
    try:
        assert granted.refused == []
        assert os.sched_getscheduler(0) == os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        assert os.sched_getparam(0).sched_priority == 7
        assert len(os.sched_getaffinity(0)) == 1
    finally:
        granted.close()
    assert os.sched_getscheduler(0) == os.SCHED_OTHER


@pytest.mark.slow
@pytest.mark.skipif(not IS_ROOT, reason="needs the right to become an ordinary user; skipped without it")
def test_an_ordinary_user_runs_without_refused_measures():
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:  # a process that has given up being root cannot get it back, so that this needs one of its own
        try:
            os.setgid(65534)
            os.setuid(65534)
            os.write(writer, apply(ScheduleRequest()).text.encode())
        finally:
            os._exit(0)  # whatever happens: it would go on with the tests
    os.waitpid(child, 0)
    text = os.read(reader, 4096).decode()
    os.close(reader)
    os.close(writer)
    assert text.startswith("collector frozen, timer slack 1 ns")
    assert "without" in text and "FIFO 60 (Operation not permitted)" in text

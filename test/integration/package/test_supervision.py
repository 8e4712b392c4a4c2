"""Whatever ends a program, all that it has started ends with it, and the reader of its output sees the end."""

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from breaking.processes import REPOSITORY, named
from support.processes import until

ENDLESS = REPOSITORY / "test" / "support" / "suite" / "endless_test.py"

PYTEST = (sys.executable, "-m", "pytest", str(ENDLESS), "-q", "-o")

PROMPT = 4.0
"""Longest time until everything has ended on a busy machine; 2 on an idle one [s]."""

PROGRAM = """
import subprocess, sys, time
from solfer.supervision import supervise

supervise()
subprocess.Popen(["bash", "-c", "setsid sleep 1000 & disown"], start_new_session=True).wait()
print("started", flush=True)
if len(sys.argv) > 1:
    sys.exit(int(sys.argv[1]))
time.sleep(1000)
"""


def check_that_all_ends(process: subprocess.Popen, folder: Path, begin: float) -> str:
    """Return the rest of the output, whose end comes with that of all processes."""
    output, _ = process.communicate(timeout=60.0)
    until(lambda: not named(str(folder)), lambda: f"the end of {named(str(folder))}")
    assert time.monotonic() - begin < PROMPT
    return output


@pytest.fixture
def start(tmp_path):
    """Start commands whose environment names a folder of this test, and end what a failing test leaves."""

    def start(*command: str, **options) -> subprocess.Popen:
        environment = os.environ | {"ENDLESS_TEST": str(tmp_path)}
        return subprocess.Popen(
            command,
            cwd=REPOSITORY,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            **options,
        )

    yield start
    for process in named(str(tmp_path)):
        os.kill(process, signal.SIGKILL)


@pytest.mark.daily(2)
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
@pytest.mark.parametrize("workers", [[], ["--numprocesses", "1"]], ids=["alone", "workers"])
def test_nothing_is_left_of_ended_tests(start, tmp_path, number, workers):
    """Processes with sessions of their own, and orphans, die with pytest, which prints what had failed so far."""
    process = start(*PYTEST, f"cache_dir={tmp_path}", *workers)
    until((tmp_path / "started").exists, "a test that has started processes", 20.0)
    assert len(named(str(tmp_path))) > 3
    begin = time.monotonic()
    process.send_signal(number)
    output = check_that_all_ends(process, tmp_path, begin)
    if number == signal.SIGKILL:
        return
    assert "endless_test.py::test_that_fails" in output
    assert "interrupted: test/support/suite/endless_test.py::test_without_end" in output
    assert process.returncode in (pytest.ExitCode.INTERRUPTED, -signal.SIGKILL)  # workers may take too long


def test_background_jobs_can_interrupt_what_they_start(start, tmp_path):
    """A script starts its background jobs with SIGINT ignored; their children must not inherit that."""
    command = shlex.join((*PYTEST, f"cache_dir={tmp_path}", "-k", "receive"))
    process = start("sh", "-c", f"{command} & wait $!")
    output, _ = process.communicate(timeout=60.0)
    assert process.returncode == 0, output


def test_a_program_keeps_its_exit_code(start, tmp_path):
    process = start(sys.executable, "-c", PROGRAM, "7")
    output, _ = process.communicate(timeout=60.0)
    assert (output, process.returncode) == ("started\n", 7)
    assert named(str(tmp_path)) == []


@pytest.mark.parametrize("victim", ["front", "keeper", "program"])
def test_a_kill_of_each_process_takes_the_others_along(start, tmp_path, victim):
    process = start(sys.executable, "-c", PROGRAM)
    assert process.stdout.readline() == "started\n"
    chain = [process.pid]
    for _ in range(2):
        children = Path(f"/proc/{chain[-1]}/task/{chain[-1]}/children").read_text().split()
        chain.append(int(children[0]))
    begin = time.monotonic()
    os.kill(chain[("front", "keeper", "program").index(victim)], signal.SIGKILL)
    check_that_all_ends(process, tmp_path, begin)
    assert process.returncode == -signal.SIGKILL

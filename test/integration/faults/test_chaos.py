"""The short form of `benchmark/chaos.py`: systems that are broken at random, with seeds that do not change."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from breaking.processes import REPOSITORY, WAIT, named
from support.processes import until

CHAOS = (sys.executable, str(REPOSITORY / "benchmark" / "chaos.py"))
SEED = "8"
"""In ROS it kills the plugin that merges and restarts one of the others; in RT it stops one and kills the bridge."""

SHARED_MEMORY = Path("/dev/shm")

pytestmark = pytest.mark.soak


@pytest.mark.parametrize("system", ["ros", "rt"])
def test_two_faults_move_nothing_without_a_command(system, tmp_path):
    done = subprocess.run(
        [*CHAOS, "--trials", "1", "--seed", SEED, "--system", system, "--logs", str(tmp_path), "--json"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert rows and all(row["name"].startswith(f"{system}: ") and row["failures"] == 0 for row in rows)


def test_an_interrupt_leaves_nothing_behind(tmp_path):
    """Ctrl-C amid all its processes ends them and their shared memory. Leftovers would slow down whatever runs next."""
    environment = os.environ | {"CHAOS_OF_THIS_TEST": str(tmp_path)}
    process = subprocess.Popen(
        [*CHAOS, "--system", "rt", "--logs", str(tmp_path)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        until(lambda: list(tmp_path.glob("*/upper_body.log")), "all processes", 2.0 * WAIT)
        assert len(named(str(tmp_path))) > 3
        process.send_signal(signal.SIGINT)
        _, published = process.communicate(timeout=WAIT)
    except BaseException:
        for left in named(str(tmp_path)):  # they would slow down all tests that follow
            os.kill(left, signal.SIGKILL)
        raise
    assert process.returncode == 130
    assert "Traceback" not in published
    until(lambda: not named(str(tmp_path)), lambda: f"the end of {named(str(tmp_path))}")
    assert not list(SHARED_MEMORY.glob(f"solfer-breaking-{process.pid}-*"))

"""Ctrl-C in `./run demo` at any moment: everything ends, with wheels at rest."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from breaking.processes import REPOSITORY, WAIT, named, until

from solfer.recording.reader import read

WHEELS = tuple(f"j_wheel_{leg}" for leg in (1, 2, 3, 4))
ROCKS = 0.3
"""Largest speed of a wheel below a body that still rocks on its legs after it has braked from 3 rad/s [rad/s]."""
MEASURED, WANTED = "full_compensation/measured/velocity", "full_compensation/wanted/velocity"


@pytest.fixture
def demo(tmp_path):
    """Start the demonstration, as a terminal does: its processes get a signal together."""
    log = tmp_path / "output.txt"
    with log.open("w") as output:
        process = subprocess.Popen(
            [
                sys.executable,
                str(REPOSITORY / "nodes" / "demo"),
                "--no-film",
                "--lockstep",
                "--output",
                str(tmp_path / "out"),
            ],
            stdout=output,
            stderr=subprocess.STDOUT,
            env=os.environ | {"DEMO_OF_THIS_TEST": str(tmp_path), "PYTHONUNBUFFERED": "1"},
            start_new_session=True,
        )
    yield process, log
    if process.poll() is None:
        process.kill()


@pytest.mark.daily(1)
@pytest.mark.parametrize(("sight", "later"), [("first motion", 3.0), ("ROS master", 0.0), ("first motion", 0.5)])
def test_an_interrupt_ends_all_at_rest(demo, tmp_path, sight, later):
    """Ctrl-C at the start or amid a motion ends all processes, and the recording ends with measured wheels at rest."""
    process, log = demo
    until(lambda: sight in log.read_text(), sight, 2.0 * WAIT)
    time.sleep(later)
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(WAIT) == 128 + signal.SIGINT
    assert "Traceback" not in log.read_text() + (tmp_path / "out" / "roslaunch.log").read_text()
    until(lambda: not named(str(tmp_path)), lambda: f"the end of {named(str(tmp_path))}")
    if later < 3.0:
        return
    recording = read(tmp_path / "out" / "run.mcap")
    wanted, measured = (
        np.stack([recording[name].column(wheel) for wheel in WHEELS], axis=1) for name in (WANTED, MEASURED)
    )
    assert np.abs(measured).max() > 0.5 and np.abs(wanted[-1]).max() < ROCKS
    assert np.abs(measured[-20:]).mean(axis=0).max() < ROCKS

"""Ctrl-C in `./run demo` at any moment: everything ends, with wheels at rest."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from breaking.processes import REPOSITORY, WAIT, named
from support.processes import until

from solfer.recording.reader import read

WHEELS = tuple(f"j_wheel_{leg}" for leg in (1, 2, 3, 4))
ROCKS = 0.3
"""Largest speed of a wheel below a body that still rocks on its legs after it has braked from 3 rad/s [rad/s]."""
DRIVES = 0.5
"""Speed of a wheel at which the robot is under way [rad/s]."""
LOOK = 0.5
"""Time between two looks at the recording, which grows [s]."""
MEASURED = "full_compensation/measured/velocity"


def fastest_wheel(folder: Path) -> float:
    """Read the largest speed of a wheel from the recording, also while it is written [rad/s]."""
    time.sleep(LOOK)
    file = folder / "out" / "run.mcap"
    channels = read(file).channels if file.is_file() and file.stat().st_size else {}
    if MEASURED not in channels:
        return 0.0
    return max(np.abs(channels[MEASURED].column(wheel)).max(initial=0.0) for wheel in WHEELS)


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
@pytest.mark.parametrize(("sight", "later"), [("first motion", None), ("ROS master", 0.0), ("first motion", 0.5)])
def test_an_interrupt_ends_all_at_rest(demo, tmp_path, sight, later):
    """Ctrl-C at the start or while it drives ends all processes, with wheels at rest."""
    process, log = demo

    def begun() -> bool:
        assert process.poll() is None, log.read_text()
        return sight in log.read_text()

    until(begun, lambda: f"{sight!r}, only:\n{log.read_text()}", 2.0 * WAIT)
    if later is None:
        until(lambda: fastest_wheel(tmp_path) > DRIVES, "wheels that turn", 2.0 * WAIT)
    else:
        time.sleep(later)
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(WAIT) == 128 + signal.SIGINT
    output = (tmp_path / "out" / "roslaunch.log").read_text()
    assert "Traceback" not in log.read_text() + output
    until(lambda: not named(str(tmp_path)), lambda: f"the end of {named(str(tmp_path))}")
    if later is None:
        end = re.search(r"the simulation ends .*", output)[0]  # beside other load arms still move
        assert all(float(speed) < ROCKS for speed in re.findall(r"wheel_\d (\S+)\b", end)), end

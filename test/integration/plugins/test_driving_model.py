"""`benchmark/driving.py --model`: drives in the model alone, and what slows them down."""

import subprocess
import sys

import pytest
from support.estimation import part

TAGS = "base: center_of_mass"


def drive(*parts):
    """Drive along parts of a course."""
    return part("driving_cases.model").drive_model("course", parts, 0, tags=TAGS)


@pytest.mark.daily(1)
@pytest.mark.parametrize(
    ("motion", "cause", "lost"),
    [({"x": 0.1, "up": 0.03}, None, 0.0), ({"y": 0.1}, "wheels", 0.3), ({"x": 0.8}, "speeds", 0.3)],
    ids=["forward and up", "sideways", "too fast"],
)
def test_lost_time_has_its_cause(motion, cause, lost):
    course = part("driving_cases.courses")
    figures = drive(course.Part(3.0, **motion))
    assert figures["done"] and figures["com_rms"] < 3e-3 and figures["vertex_rms"] < 3e-3
    found = figures["lost"]
    own = course.Profile((course.Part(3.0, **motion),), 0.005).duration
    assert (figures["duration"] - 1.0) * own == pytest.approx(sum(found.values()), abs=0.3)
    largest = max(found, key=found.__getitem__)
    assert (found[largest] < 0.01) if cause is None else (largest == cause and found[cause] > lost)


def test_the_model_has_no_world(repository):
    command = [sys.executable, str(repository / "benchmark/driving.py"), "slow", "--model", "--estimated"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2 and "--model has no world" in done.stderr

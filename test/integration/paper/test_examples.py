"""The examples, as a user runs them."""

import re
import subprocess
import sys

import pytest

HELD, AT_REST = 0.05, 0.02  # [rad], [rad/s]


def numbers(repository, name: str) -> list[float]:
    """Return the numbers that an example prints after two simulated seconds."""
    command = [sys.executable, str(repository / "examples" / name), "--duration", "2"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return [float(number) for number in re.findall(r"\d+(?:\.\d+)?", done.stdout)]


def test_an_arm_holds_its_weight(repository):
    joints, duration, gave_way, speed = numbers(repository, "arm.py")
    assert (joints, duration) == (7, 2)
    assert 0.0 < gave_way < HELD
    assert speed < AT_REST


def test_a_generator_of_its_own_drives(repository):
    forward, aside, duration = numbers(repository, "listing_16.py")
    assert duration == 2 and aside < 0.01
    assert forward == pytest.approx(0.2 * 2 - 0.5 * 0.2**2 / (3.0 * 0.078), abs=0.02)  # it speeds up at 3 rad/s2


@pytest.mark.soak
def test_solo_stands(repository):
    joints, duration, gave_way, speed, carried, weight = numbers(repository, "quadruped.py")
    assert (joints, duration) == (12, 2)
    assert 0.0 < gave_way < HELD
    assert speed < AT_REST
    assert carried == pytest.approx(weight, rel=0.01)

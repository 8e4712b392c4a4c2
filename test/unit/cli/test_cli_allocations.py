"""`solfer allocations`: which lines take memory in a cycle, on a recording and on the simulated robot."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from support.plugins.fleet import loaded
from support.recording.sine import recorded, tree
from support.unit.cart import URDF

from solfer.components import Component
from solfer_tools.cli.main import main

REACH = f"{__name__}:Reach"
CLEAN = f"{__name__}:Clean"
FILE = Path(__file__)


class Reach(Component):
    """Takes memory in its cycle, some of it for good."""

    def init(self):
        self._begin, self._errors = self.model.state.position.copy(), []

    def update(self):
        error = self._begin - self.model.state.position
        self._errors.append(error)
        np.multiply(error, 0.5, out=self.model.command.position)
        self.model.command.position += self.model.state.position


class Clean(Component):
    """Takes none."""

    def init(self):
        self._begin = self.model.state.position.copy()

    def update(self):
        command = self.model.command.position
        np.subtract(self._begin, self.model.state.position, out=command)
        command *= 0.5
        np.add(command, self.model.state.position, out=command)


@pytest.fixture
def recording(tmp_path):
    """Record the component that allocates nothing."""
    return recorded(tmp_path, CLEAN, 120)


def check(folder, *more):
    return main(["allocations", str(folder / "main.yaml"), "-n", "first", *map(str, more)])


def row_of(text, output):
    """Return the columns of the line of the component's source that has a text."""
    number = next(index for index, line in enumerate(FILE.read_text().splitlines(), 1) if text in line)
    rows = [re.split(r"\s{2,}", line.strip()) for line in output.splitlines() if f"{FILE.name}:{number}" in line]
    assert rows, output
    return rows[0]


@pytest.mark.slow
def test_planted_allocations_are_named(recording, tmp_path, capsys):
    loaded(tmp_path, tree(REACH), ("first",))
    assert check(tmp_path, "--recording", recording) == 1
    output = capsys.readouterr().out
    _, function, times, size, kept, because = row_of("error = ", output)
    assert (function, times, because) == ("update", "1", "-")
    assert 112 <= float(size) < 400 and 100 < float(kept) < 400
    assert "state.py" in output and FILE.name in row_of("+= self", output)[-1]


@pytest.mark.slow
def test_component_that_allocates_nothing_passes(recording, tmp_path, capsys):
    assert check(tmp_path, "--recording", recording) == 0
    assert FILE.name not in capsys.readouterr().out


@pytest.mark.slow
def test_simulated_robot_is_enough(tmp_path, capsys):
    changed = tree(REACH)
    changed["ros"]["source"] = {"urdf": "/robot_description"}
    loaded(tmp_path, changed, ("first",))
    robot = tmp_path / "robots" / "cart"
    robot.mkdir(parents=True)
    (robot / "cart.urdf").write_text(URDF)
    bundle = {"name": "cart", "urdf": "cart.urdf", "controllers": {"left": {"type": "impedance"}}}
    bundle["floating_base"] = False
    (robot / "robot.yaml").write_text(yaml.safe_dump(bundle))
    assert check(tmp_path) == 1
    output = capsys.readouterr().out
    assert row_of("error = ", output)[2] == "1" and "the simulated robot" in output


def test_recording_that_is_too_short_is_refused(tmp_path, capsys):
    recording = recorded(tmp_path, CLEAN, 20)
    assert check(tmp_path, "--recording", recording) == 2
    assert re.search(r"run.mcap: 'first' runs in \d+ cycles\n  expected: at least 40", capsys.readouterr().err)


def test_allocations_of_no_plugin_are_refused(tmp_path, capsys):
    loaded(tmp_path, tree(CLEAN), ("first",))
    assert main(["allocations", str(tmp_path / "main.yaml")]) == 2
    assert "expected: -n NAME" in capsys.readouterr().err

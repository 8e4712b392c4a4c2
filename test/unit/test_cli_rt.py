"""`solfer rt` beside an RT layer, and without one."""

import shutil
import uuid
from pathlib import Path

import numpy as np
import pytest

from solfer.cli.main import main
from solfer.middleware.xbot.board import Board
from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.lifecycle import Stage
from solfer.middleware.xbot.tally import tally


@pytest.fixture
def namespace():
    name = f"test-{uuid.uuid4().hex}"
    yield name
    shutil.rmtree(Path("/dev/shm") / f"solfer-{name}", ignore_errors=True)


def rt(namespace, *arguments):
    """Exit code of `solfer rt`."""
    return main(["rt", "--namespace", namespace, *arguments])


def test_top_and_state_tell_what_is_on_the_board(namespace, capsys):
    folder = Path("/dev/shm") / f"solfer-{namespace}"
    board = Board.create(folder, 1000.0, ["legs", "arms"], ["read", "component"])
    board.counts[0], board.counts[1] = 4321, 5
    times = np.zeros(len(board.histograms.rows), dtype=np.int64)
    times[board.row(1, 1)] = 250_000
    tally(board.histograms.rows, times, 0)
    board.skips[board.row(1, 1)] = 5
    board.put_life(1, Stage.ABORTED, 2, 1, 20)
    board.put_text("too slow", 1)
    EmergencyStop(folder).trip("smoke")
    assert rt(namespace, "top", "--once") == 0
    lines = capsys.readouterr().out.splitlines()
    assert "1000 Hz, 4321 cycles, 5 periods skipped, 0 overruns" in lines[0] and "smoke" in lines[2]
    assert lines[3].split() == ["[us]", "stage", "count", "p50", "p99", "max", "skips"]
    assert lines[-1].split() == ["arms", "component", "1", "250.0", "250.0", "250.0", "5"]
    assert rt(namespace, "state") == 0
    assert capsys.readouterr().out.splitlines()[-1].split(maxsplit=5) == ["arms", "ABORTED", "2", "1", "20", "too slow"]
    board.close()


def test_the_emergency_stop_needs_nobody_who_answers(namespace):
    assert rt(namespace, "estop", "a dog") == 0
    assert EmergencyStop(Path("/dev/shm") / f"solfer-{namespace}").reason.startswith("a dog (process ")


@pytest.mark.parametrize("arguments", [("top", "--once"), ("state",), ("abort", "legs")])
def test_without_an_rt_layer_the_cure_is_told(namespace, capsys, arguments):
    assert rt(namespace, *arguments) == 2
    assert "no RT layer" in (error := capsys.readouterr().err) and "rosrun solfer xbot" in error


def test_a_plugin_that_is_not_there_is_named(namespace, capsys):
    board = Board.create(Path("/dev/shm") / f"solfer-{namespace}", 1000.0, ["legs"], ["read"])
    assert rt(namespace, "abort", "leg") == 2
    assert "did you mean: legs" in capsys.readouterr().err
    board.close()

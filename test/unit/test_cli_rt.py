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


def count(board, nanoseconds):
    """The component of the second plugin took that long once more."""
    times = np.zeros(len(board.histograms.rows), dtype=np.int64)
    times[board.row(1, 1)] = nanoseconds
    tally(board.histograms.rows, times, 0)


@pytest.fixture
def board(namespace):
    """That of a layer with two plugins, one of which was too slow."""
    made = Board.create(Path("/dev/shm") / f"solfer-{namespace}", 1000.0, ["legs", "arms"], ["read", "component"])
    made.counts[0], made.counts[1] = 4321, 5
    count(made, 250_000)
    made.skips[made.row(1, 1)] = 5
    made.put_life(0, Stage.RUNNING, 1, 0, 0)
    made.put_life(1, Stage.ABORTED, 2, 1, 20)
    made.put_text("too slow", 1)
    yield made
    made.close()


def cells(text, title):
    """What stands behind that title in each of its lines."""
    return [line.split()[1:] for line in text.splitlines() if line.split()[:1] == [title]]


def test_top_tells_what_is_on_the_board(namespace, board, capsys):
    EmergencyStop(Path("/dev/shm") / f"solfer-{namespace}").trip("smoke")
    assert rt(namespace, "top", "--once") == 0
    text = capsys.readouterr().out
    lines = [line.split() for line in text.splitlines()]
    assert "1000 Hz, a period of 1000 us" in text and "cycles 4321, periods left out 5, cycles too long 0" in text
    assert "emergency stop: smoke (process" in text and "\x1b" not in text
    assert ["legs", "RUNNING", "1", "0", "0"] in lines and ["arms", "ABORTED", "2", "1", "20", "too", "slow"] in lines
    assert ["times", "[us]", "p50", "p99", "max", "left", "out"] in lines
    assert ["legs", "read", "-", "-", "-", "0"] in lines and ["component", "250.0", "250.0", "250.0", "5"] in lines
    assert "p50 and p99 are of all cycles" in text


def test_a_live_table_tells_the_newest_times_and_outlives_the_layer(namespace, board, capsys, monkeypatch):
    pauses = []

    def pause(duration):
        pauses.append(duration)
        if len(pauses) == 1:
            count(board, 1000)
        elif len(pauses) == 2:
            board.close()
        else:
            raise KeyboardInterrupt

    monkeypatch.setattr("solfer.cli.rt_actions.time.sleep", pause)
    assert rt(namespace, "top", "--every", "2.5") == 0
    first, second, third = capsys.readouterr().out.split("RT layer")[1:]
    assert cells(first, "component") == [["-", "-", "-", "0"], ["250.0", "250.0", "250.0", "5"]]
    assert cells(second, "component")[1] == ["1.0", "1.0", "250.0", "5"]
    assert "p50 and p99 are of all cycles" in first and "p50 and p99 are of the last 2.5 s" in second
    assert third.strip() == "has ended" and pauses == [2.5] * 3


def test_state_tells_of_all_plugins_or_of_those_that_are_named(namespace, board, capsys):
    assert rt(namespace, "state") == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["plugin", "legs", "arms"]
    assert rt(namespace, "state", "arms") == 0
    assert capsys.readouterr().out.splitlines()[1].split(maxsplit=5) == ["arms", "ABORTED", "2", "1", "20", "too slow"]
    assert rt(namespace, "state", "arm") == 2
    assert "did you mean: arms" in capsys.readouterr().err


def test_the_namespace_may_stand_behind_the_action(namespace, board, capsys):
    assert main(["rt", "state", "--namespace", namespace, "legs"]) == 0
    assert "legs" in capsys.readouterr().out


@pytest.mark.parametrize(("action", "arguments", "words"), [
    (" state", ("legs", "--slow"), "unrecognized arguments: --slow"),
    (" top", ("legs",), "unrecognized arguments: legs"),
    (" top", ("--every", "-1"), "argument --every: '-1' is no time above zero"),
    (" record", ("a.npz", "--seconds", "soon"), "argument --seconds: 'soon' is no time above zero"),
    (" record", ("a.npz", "--seconds", "2", "--last"), "argument --last: not allowed with argument --seconds"),
    ("", ("halt",), "argument ACTION: invalid choice: 'halt'"),
])
def test_a_mistake_in_the_command_is_told_with_the_usage_of_that_command(namespace, capsys, action, arguments, words):
    with pytest.raises(SystemExit) as end:
        rt(namespace, *action.split(), *arguments)
    error = capsys.readouterr().err
    assert end.value.code == 2 and error.startswith(f"usage: solfer rt{action} [-h]")
    assert f"solfer rt{action}: error: {words}" in error


def test_without_a_recording_the_cure_is_told(namespace, capsys, tmp_path):
    assert rt(namespace, "record", str(tmp_path / "a.npz"), "--last") == 2
    assert "there is no recording" in (error := capsys.readouterr().err) and "`record` above 0" in error
    assert not list(tmp_path.iterdir())


def test_the_emergency_stop_needs_nobody_who_answers(namespace):
    assert rt(namespace, "estop", "a dog") == 0
    assert EmergencyStop(Path("/dev/shm") / f"solfer-{namespace}").reason.startswith("a dog (process ")


@pytest.mark.parametrize("arguments", [("top", "--once"), ("state",), ("abort", "legs")])
def test_without_an_rt_layer_the_cure_is_told(namespace, capsys, arguments):
    assert rt(namespace, *arguments) == 2
    assert "no RT layer" in (error := capsys.readouterr().err) and "rosrun solfer xbot" in error


def test_a_plugin_that_is_not_there_is_named(namespace, board, capsys):
    assert rt(namespace, "abort", "leg") == 2
    assert "did you mean: legs" in capsys.readouterr().err

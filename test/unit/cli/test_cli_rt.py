"""`solfer rt` beside an RT layer, and without one."""

import json
import os
import shutil
import subprocess
import sys
import uuid
from pathlib import Path

import numpy as np
import pytest

from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.plugins import PluginState
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.segments.namespace import Namespace
from solfer.telemetry.kernel import count_durations
from solfer.telemetry.statistics import LoopCount, RuntimeStatistics
from solfer.transport.health import Health
from solfer_tools.cli.main import main


@pytest.fixture
def namespace():
    name = f"test-{uuid.uuid4().hex}"
    folder = Namespace(name).folder
    yield name
    shutil.rmtree(folder)


def rt(namespace, *arguments):
    """Run `solfer rt`, and return its exit code."""
    return main(["rt", "--namespace", namespace, *arguments])


def count(statistics, nanoseconds):
    """Count one more cycle in which the component of the second plugin needed that time."""
    times = np.zeros(len(statistics.histograms), dtype=np.int64)
    times[statistics.row(1, 1)] = nanoseconds
    count_durations(statistics.histograms, times, 0)


@pytest.fixture
def statistics(namespace):
    """Make the statistics of a layer with two plugins, one of which was too slow."""
    made = RuntimeStatistics.create(
        Path("/dev/shm") / f"solfer-{namespace}", 1000.0, ["legs", "arms"], ["read", "component"]
    )
    made.counts[LoopCount.CYCLES], made.counts[LoopCount.SKIPPED] = 4321, 5
    count(made, 250_000)
    made.skips[made.row(1, 1)] = 5
    made.put_life(0, PluginState.RUNNING, 1, 0, 0)
    made.put_life(1, PluginState.ABORTED, 2, 1, 20)
    made.put_text("too slow", 1)
    made.put_computed(1, {"kinematics": 4320, "inertia_inverse": 12})
    yield made
    made.close()


def cells(text, title):
    """Return the cells behind a title in each of its lines."""
    return [line.split()[1:] for line in text.splitlines() if line.split()[:1] == [title]]


def test_top_prints_the_statistics(namespace, statistics, capsys):
    EmergencyStopLatch(Path("/dev/shm") / f"solfer-{namespace}").trip("smoke")
    assert rt(namespace, "top", "--once") == 0
    text = capsys.readouterr().out
    lines = [line.split() for line in text.splitlines()]
    assert "1000 Hz, a period of 1000 us" in text and "cycles 4321, periods left out 5, cycles too long 0" in text
    assert "emergency stop: smoke (process" in text and "\x1b" not in text
    assert ["legs", "RUNNING", "1", "0", "0"] in lines and ["arms", "ABORTED", "2", "1", "20", "too", "slow"] in lines
    assert ["computed", "kinematics", "inertia", "inverse"] in lines
    assert ["legs", "0", "0"] in lines and ["arms", "4320", "12"] in lines
    assert ["times", "[us]", "p50", "p99", "max", "left", "out"] in lines
    assert ["legs", "read", "-", "-", "-", "0"] in lines and ["component", "250.0", "250.0", "250.0", "5"] in lines
    assert "p50 and p99 are of all cycles" in text


def test_top_names_the_health_of_each_part(namespace, statistics, capsys):
    """Of what other processes report, too; with and without `rt`."""
    node = XbotMiddleware(namespace, "other")
    node.report("legs pipes", Health.WARNING, "no publisher\nof imu", {})
    texts = []
    for words in (["rt", "top"], ["top"]):
        assert main([*words, "--namespace", namespace, "--once"]) == 0
        texts.append(capsys.readouterr().out)
    assert main(["top", "--namespace", namespace, "--once", "--json"]) == 0
    parts = json.loads(capsys.readouterr().out)
    assert parts["arms"]["health"] == "ERROR" and parts["legs pipes"]["why"] == "no publisher\nof imu"
    node.close()
    assert texts[0] == texts[1]
    lines = [line.split(maxsplit=2) for line in texts[0].split("RT layer")[0].splitlines() if line]
    assert lines[:3] == [["part", "health", "why"], ["arms", "ERROR", "ABORTED: too slow"], ["legs", "GOOD", "RUNNING"]]
    assert "legs pipes  WARNING  no publisher of imu" in texts[0]
    assert lines[-1][0] == "xbotcore"


def test_top_fits_a_terminal_and_colours_the_health(namespace, statistics, capsys, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "24")
    for no_color, line in (("", "arms      \x1b[31mERROR\x1b[0m    ABOR…"), ("1", "arms      ERROR    ABOR…")):
        monkeypatch.setenv("NO_COLOR", no_color)
        assert rt(namespace, "top", "--once") == 0
        shown = capsys.readouterr().out.splitlines()
        assert next(each for each in shown if each.startswith("arms")) == line


def test_a_live_table_outlives_the_layer(namespace, statistics, capsys, monkeypatch):
    """The first table covers all cycles, later ones the interval alone; after the layer's end it says so and waits."""
    pauses = []

    def pause(duration):
        pauses.append(duration)
        if len(pauses) == 1:
            count(statistics, 1000)
        elif len(pauses) == 2:
            statistics.close()
        else:
            raise KeyboardInterrupt

    monkeypatch.setattr("solfer.cli.rt.top.time.sleep", pause)
    assert rt(namespace, "top", "--every", "2.5") == 0
    first, second, third = capsys.readouterr().out.split("RT layer")[1:]
    assert cells(first, "component") == [["-", "-", "-", "0"], ["250.0", "250.0", "250.0", "5"]]
    assert cells(second, "component")[1] == ["1.0", "1.0", "250.0", "5"]
    assert "p50 and p99 are of all cycles" in first and "p50 and p99 are of the last 2.5 s" in second
    assert third.strip() == "has ended" and pauses == [2.5] * 3


def test_state_prints_all_or_the_named_plugins(namespace, statistics, capsys):
    assert rt(namespace, "state") == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["plugin", "legs", "arms"]
    assert rt(namespace, "state", "arms") == 0
    assert capsys.readouterr().out.splitlines()[1].split(maxsplit=5) == ["arms", "ABORTED", "2", "1", "20", "too slow"]
    assert rt(namespace, "state", "arm") == 2
    assert "did you mean: arms" in capsys.readouterr().err


def test_the_namespace_may_stand_behind_the_action(namespace, statistics, capsys):
    assert main(["rt", "state", "--namespace", namespace, "legs"]) == 0
    assert "legs" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("action", "arguments", "words"),
    [
        (" state", ("legs", "--slow"), "unrecognized arguments: --slow"),
        (" top", ("legs",), "unrecognized arguments: legs"),
        (" top", ("--every", "-1"), "argument --every: '-1', expected a number from 0.01 to 86400"),
        (" record", ("a.npz", "--seconds", "soon"), "argument --seconds: 'soon', expected a number from 0.01 to 86400"),
        (" record", ("a.npz", "--seconds", "2", "--last"), "argument --last: not allowed with argument --seconds"),
        ("", ("halt",), "argument ACTION: invalid choice: 'halt'"),
    ],
)
def test_a_wrong_command_shows_its_own_usage(namespace, capsys, action, arguments, words):
    with pytest.raises(SystemExit) as end:
        rt(namespace, *action.split(), *arguments)
    error = capsys.readouterr().err
    assert end.value.code == 2 and error.startswith(f"usage: solfer rt{action} [-h]")
    assert f"solfer rt{action}: error: {words}" in error


@pytest.mark.parametrize(
    ("arguments", "close"), [(["chek"], "check"), (["log", "inf", "run.mcap"], "info"), (["rt", "stat"], "state")]
)
def test_a_wrong_word_gets_the_nearest_ones(capsys, arguments, close):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2 and f"\n  did you mean: {close}" in capsys.readouterr().err


@pytest.mark.slow
def test_plugins_that_never_come_are_named(tmp_path, capsys):
    assert main(["record", "-n", "nobody", "--wait", "0.3", "test_nowhere", str(tmp_path / "a.mcap")]) == 2
    assert "unknown plugin 'nobody'" in capsys.readouterr().err


def test_a_missing_recording_is_explained(namespace, capsys, tmp_path):
    assert rt(namespace, "record", str(tmp_path / "a.npz"), "--last") == 2
    assert "there is no recording" in (error := capsys.readouterr().err) and "`record` above 0" in error
    assert not list(tmp_path.iterdir())


def test_an_emergency_stop_without_a_layer_fails(namespace, capsys):
    assert rt(namespace, "estop", "a dog") == 2
    assert f"no plugin obeys: no RT layer lives in the namespace '{namespace}'" in capsys.readouterr().err
    assert EmergencyStopLatch(Path("/dev/shm") / f"solfer-{namespace}").reason.startswith("a dog (process ")


@pytest.fixture
def answers(namespace, statistics, monkeypatch):
    """Return a function that lets the layer answer as soon as `solfer rt estop` waits."""
    stop = EmergencyStopLatch(Path("/dev/shm") / f"solfer-{namespace}")
    stop.answer("arms at rest")  # to an earlier one
    return lambda *answer: monkeypatch.setattr("solfer.cli.rt.estop.time.sleep", lambda duration: stop.answer(*answer))


def test_an_emergency_stop_waits_until_all_obey(namespace, statistics, capsys, answers):
    answers("legs, arms at rest")
    assert rt(namespace, "estop", "a dog") == 0
    assert capsys.readouterr().out == f"process {statistics.pid} obeys: legs, arms at rest\n"


def test_a_plugin_that_cannot_hold_is_named(namespace, statistics, capsys, answers):
    answers("'legs' cannot hold: no torque", False)
    assert rt(namespace, "estop") == 2
    assert "'legs' cannot hold: no torque" in capsys.readouterr().err


HEAVY = {"numpy", "numba", "pinocchio", "pybullet", "scipy", "yaml", "pydantic", "concurrent.futures", "json"}


def test_an_emergency_stop_imports_next_to_nothing(namespace):
    """It has to work at once, also on a full machine, and for a user without a home: nothing may be compiled for it."""
    code = f"""
import sys
from solfer_tools.cli.main import main
main(["rt", "--namespace", {namespace!r}, "estop"])
sys.exit(", ".join({HEAVY!r} & set(sys.modules)))
"""
    environment = os.environ | {"HOME": "/nowhere", "NUMBA_CACHE_DIR": "/nowhere"}
    ended = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert "no plugin obeys: no RT layer lives in the namespace" in ended.stderr
    assert ended.stderr.splitlines()[2:] == [""] and EmergencyStopLatch(Path("/dev/shm") / f"solfer-{namespace}")


def test_a_layer_that_ignores_the_stop_is_named(namespace, statistics, capsys, monkeypatch):
    monkeypatch.setattr("solfer.cli.rt.estop.LATCH_TIMEOUT", 0.05)
    assert rt(namespace, "estop") == 2
    assert f"process {statistics.pid} has not read the emergency stop" in capsys.readouterr().err


@pytest.mark.parametrize(
    "action",
    [
        ("top", "--once"),
        ("state",),
        ("abort", "legs"),
        ("switch", "--start", "legs"),
        ("estop",),
        ("estop", "--clear"),
        ("record", "a.npz", "--last"),
    ],
    ids=" ".join,
)
def test_a_wrong_namespace_is_not_made(namespace, statistics, capsys, action):
    wrong = f"{namespace}x"
    assert rt(wrong, *action) == 2
    published = capsys.readouterr().err
    assert f"unknown namespace '{wrong}'" in published and namespace in published.partition("did you mean: ")[2]
    [living] = [line for line in published.splitlines() if "an RT layer that lives" in line]
    assert namespace in living
    assert not (Path("/dev/shm") / f"solfer-{wrong}").exists()


@pytest.mark.parametrize("arguments", [("top", "--once"), ("state",), ("abort", "legs")])
def test_a_missing_rt_layer_is_explained(namespace, capsys, arguments):
    assert rt(namespace, *arguments) == 2
    assert "no RT layer" in (error := capsys.readouterr().err) and "rosrun solfer xbot" in error


def test_a_plugin_that_is_not_there_is_named(namespace, statistics, capsys):
    assert rt(namespace, "abort", "leg") == 2
    assert "did you mean: legs" in capsys.readouterr().err

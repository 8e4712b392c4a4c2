"""`solfer scenario`: a row for each step, the sum, and the picture."""

import numpy as np
import pytest
from support.unit.scenarios import made

from solfer_tools.cli.main import main
from solfer_tools.cli.scenario_trace import ScenarioTrace
from solfer_tools.scenarios import read_scenario


def printed(capsys, *arguments):
    """Return the cells of the lines."""
    assert main(["scenario", *map(str, arguments)]) == 0
    return [line.split() for line in capsys.readouterr().out.splitlines()]


def test_each_step_has_time_place_and_way(repository, capsys):
    head, first, *others, total = printed(capsys, repository / "config/scenarios/shape_side.yaml")
    assert head[:2] == ["step", "verb"]
    assert first == ["1", "move", "0.00", "3.90", "0.195", "0.000", "0.000", "0.000", "0.195", "0.000"]
    assert [row[:2] for row in others] == [["2", "speed"], ["3", "wait"]]
    assert total[:5] == ["3", "steps,", "3.90", "s,", "0.195"]


def test_the_page_shows_what_is_printed(repository, capsys):
    page = (repository / "docs/reference/navigation.md").read_text()
    assert main(["scenario", str(repository / "config/scenarios/shape_side.yaml")]) == 0
    assert f"```text\n{capsys.readouterr().out}```" in page


def test_the_constant_velocity_belongs_to_the_way(tmp_path):
    trace = ScenarioTrace(made(tmp_path, [{"type": "wait", "steps": 200}], base_const_vel=[0.3, 0.4, 0.0, 0.1]))
    np.testing.assert_allclose(trace.base[-1], (0.6, 0.8, 0.0, 0.2), atol=1e-12)
    assert trace.distance[-1] == pytest.approx(1.0) and trace.times[-1] == pytest.approx(2.0)


@pytest.mark.slow
def test_the_picture_is_written(repository, capsys, tmp_path):
    out = tmp_path / "way.png"
    lines = printed(capsys, repository / "config/scenarios/circular.yaml", "--plot", out)
    assert lines[-1] == [str(out)] and out.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("name", "part"), [("hw.yaml", "hw.yaml:9:2: not YAML"), ("none.yaml", "no file")])
def test_a_wrong_file_is_one_error(repository, capsys, name, part):
    assert main(["scenario", str(repository / "test/data/scenarios" / name)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and part in error


def test_another_kind_of_picture_is_refused(repository, capsys, tmp_path):
    file = repository / "config/scenarios/shape_side.yaml"
    assert main(["scenario", str(file), "--plot", str(tmp_path / "way.gif")]) == 2
    assert ".gif" in capsys.readouterr().err


@pytest.mark.slow
def test_the_rows_of_a_long_file_add_up(repository):
    trace = ScenarioTrace(read_scenario(repository / "config/scenarios/events.yaml"))
    rows = list(trace.rows())[1:]
    assert len(rows) == 18
    assert sum(float(row[3]) for row in rows) == pytest.approx(trace.scenario.duration)
    assert sum(float(row[8]) for row in rows) == pytest.approx(trace.distance[-1], abs=0.01)

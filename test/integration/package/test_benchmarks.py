"""All benchmarks have one form: they explain themselves, and the table lists them."""

import json
import logging
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).parents[3] / "benchmark"
SCRIPTS = sorted(path.name for path in BENCHMARK.glob("*.py") if path.name != "form.py")
PICTURES = ("rviz.py",)
"""Scripts that draw, and print no figures."""


@pytest.mark.parametrize("script", SCRIPTS)
def test_help_is_all_that_help_prints(script, monkeypatch, capsys):
    monkeypatch.setattr("solfer.supervision.supervise", lambda: None)  # it would fork
    monkeypatch.setattr(logging.root.manager, "disable", logging.NOTSET)  # some do without the warnings of others
    monkeypatch.setattr(sys, "argv", [script, "--help"])
    monkeypatch.syspath_prepend(BENCHMARK)
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(BENCHMARK / script), run_name="__main__")
    text = capsys.readouterr().out
    assert not ended.value.code and text.startswith("usage: ")
    assert len(text.splitlines()) > 4
    assert "--json" in text or script in PICTURES


def test_the_table_lists_every_script():
    listed = re.findall(r"^\| `(\w+\.py)` \|", (BENCHMARK / "README.md").read_text(), re.MULTILINE)
    assert listed == SCRIPTS


def test_a_script_prints_its_figures_as_json():
    command = [sys.executable, str(BENCHMARK / "plugin.py"), "--json", "20"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    rows = [json.loads(line) for line in ended.stdout.splitlines()]
    assert [row["name"] for row in rows] == ["at rest", "in a ramp", "1 u: computeAllTerms"]
    assert all(row["p50_us"] > 0.0 for row in rows)

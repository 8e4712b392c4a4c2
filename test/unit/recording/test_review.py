"""What needs matplotlib: pictures of recordings, and no program that records."""

import subprocess
import sys

import pytest
from support.recording.sine import recorded

from solfer.installation import pip_install
from solfer_tools.cli.main import main

MATPLOTLIB = ("matplotlib", "matplotlib.figure")


@pytest.mark.slow
@pytest.mark.parametrize("node", [None, "xbot", "recorder", pytest.param("plugin", marks=pytest.mark.needs("ros"))])
def test_what_records_imports_no_review(repository, node):
    """All modules of the rooms, or a node, in a process of its own."""
    src = repository / "src"
    files = (file for room in ("recording", "telemetry") for file in (src / "solfer" / room).rglob("*.py"))
    rooms = [".".join(file.relative_to(src).with_suffix("").parts) for file in files if "review" not in file.parts]
    load = (
        f"import runpy; runpy.run_path({str(repository / 'nodes' / node)!r})" if node else f"import {', '.join(rooms)}"
    )
    found = "{'matplotlib', 'solfer_tools.review'} & sys.modules.keys()"
    program = f"{load}; import sys; sys.exit(' '.join({found}) or 0)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr.strip()) == (0, "")


@pytest.fixture
def without_matplotlib(monkeypatch):
    for name in MATPLOTLIB:
        monkeypatch.setitem(sys.modules, name, None)


@pytest.mark.slow
def test_pictures_without_matplotlib_are_one_error(without_matplotlib, repository, tmp_path, monkeypatch, capsys):
    """Commands that draw name what is missing; the same commands without a picture do all their work."""
    file = str(recorded(tmp_path))
    monkeypatch.chdir(tmp_path)
    scenario = str(repository / "config/scenarios/shape_side.yaml")
    for command, picture in (
        (["plot", file], ["-o", "out.png"]),
        (["plot", file, "-c", "first/timing"], ["-o", "out.pdf"]),
        (["compare", file, file], ["--plot", "out.png"]),
        (["scenario", scenario], ["--plot", "out.png"]),
    ):
        if command[0] != "plot":
            assert main(command) == 0
            capsys.readouterr()
        assert main([*command, *picture]) == 2
        assert capsys.readouterr().err == f"error: pictures need matplotlib\n  expected: {pip_install('matplotlib')}\n"
    assert not list(tmp_path.glob("out.*"))

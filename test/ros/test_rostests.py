"""Runs each rostest of this folder as one test case, on a master of its own (rostest picks a free port)."""

import re
import signal
import subprocess
import warnings
from pathlib import Path
from xml.etree import ElementTree

import pytest

FOLDER = Path(__file__).parent
LIMIT = 660.0
"""Longest time of a file of tests: two tests with a limit of 300 s each on a machine that has much else to do [s]."""

GRACE = 30.0
"""Longest time that roslaunch gets to stop its nodes [s]."""


STALLED = 0.1
"""Simulated time that a simulator lost because the machine stood still, from which on plugins hold as specified [s]."""


def run(command: list[str]) -> tuple[int, str]:
    """Exit code and output of a command; at its limit it is interrupted, so that it can stop its nodes."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        output, _ = process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=GRACE)
        output += f"\nnot finished after {LIMIT:.0f} s"
    finally:
        process.kill()
    return process.returncode, output


def results(folder: Path) -> tuple[int, str]:
    """How many single tests ran, and what those that failed said."""
    count, failures = 0, []
    for path in sorted(folder.rglob("rosunit-*.xml")):
        try:
            cases = ElementTree.parse(path).iter("testcase")
        except ElementTree.ParseError:
            failures.append(f"{path.name}: ended before it wrote its results")
            continue
        for case in cases:
            count += 1
            failures += [f"{case.get('name')}: {fault.text}" for fault in case if fault.tag in ("failure", "error")]
    return count, "\n".join(failures)


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.test")), ids=lambda path: path.stem)
def test_rostest(path, repository, tmp_path):
    # Not --text: in that mode rostest reports success whatever happens.
    options = ["--pkgdir", str(repository), "--package", "solfer", "--results-base-dir", str(tmp_path)]
    code, output = run(["rostest", *options, str(path)])
    lost = max(map(float, re.findall(r"falls behind: ([0-9.]+) s lost", output)), default=0.0)
    if code != 0 and lost >= STALLED:  # a robot that had to hold says nothing about its motions; the next run counts
        warnings.warn(f"{path.name}: {lost:g} s lost, run again after\n{results(tmp_path)[1]}", stacklevel=1)
        options[-1] = str(tmp_path / "again")
        code, output = run(["rostest", *options, str(path)])
        tmp_path = tmp_path / "again"
    count, failures = results(tmp_path)
    assert code == 0, f"{output}\n{failures}"
    assert count > 0, f"no test ran:\n{output}"

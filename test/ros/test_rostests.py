"""Runs each rostest of this folder as one test case, on a master of its own (rostest picks a free port)."""

import os
import shutil
import signal
import subprocess
from contextlib import suppress
from pathlib import Path
from xml.etree import ElementTree

import pytest
from support.recording.kept import write_kept

from solfer.supervision import descendants

FOLDER = Path(__file__).parent
LIMIT = 870.0
"""Longest time of a file of tests on a machine that has much else to do [s]; `faulthandler_timeout` is longer."""

SOAK = ("compensation", "ground_forces", "policy", "stepping", "wheeled_kills")
"""Files of tests that take long; what they do has a short test in another file."""

GRACE = 30.0
"""Longest time that roslaunch gets to stop its nodes [s]."""


def run(command: list[str], log: Path, **environment: str) -> tuple[int, str]:
    """Exit code and output of a command; at its limit it is interrupted, so that it can stop its nodes."""
    late = ""
    with log.open("w") as output:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env=os.environ | environment,
        )
    try:
        process.wait(LIMIT)
    except subprocess.TimeoutExpired:
        late = f"\nnot finished after {LIMIT:.0f} s"
        process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.wait(GRACE)
    finally:
        for each in (*descendants(process.pid), process.pid):
            with suppress(ProcessLookupError):
                os.kill(each, signal.SIGKILL)
        process.wait()
    return process.returncode, log.read_text(errors="replace") + late


def results(folder: Path) -> tuple[int, str]:
    """Count the single tests that ran, and collect the output of those that failed."""
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


def most(path: Path) -> float:
    """Longest time that the tests of a file may take [s]."""
    return sum(float(test.attrib["time-limit"]) for test in ElementTree.parse(path).iter("test"))


def check(path: Path, repository: Path, tmp_path: Path, **environment: str) -> None:
    """Run the tests of a file, and leave what its nodes have recorded if one of them fails."""
    # Not --text: in that mode rostest reports success whatever happens.
    options = ["--pkgdir", str(repository), "--package", "solfer", "--results-base-dir", str(tmp_path)]
    environment["SOLFER_RECORDINGS"] = str(tmp_path / "recordings")
    code, output = run(["rostest", *options, str(path)], tmp_path / "output", **environment)
    count, failures = results(tmp_path)
    if code or not count:
        kept = write_kept(tmp_path / "recordings", repository / "out" / path.stem)
        (repository / "out").mkdir(exist_ok=True)
        # kept where a repetition passes, of which pytest shows no output
        shutil.copy(tmp_path / "output", repository / "out" / f"{path.stem}.failed")
        failures += "".join(f"\nthe last seconds of a node: {file}" for file in kept)
    assert code == 0, f"{output}\n{failures}"
    assert count > 0, f"no test ran:\n{output}"


LAUNCHES = sorted(sorted(FOLDER.glob("*.test")), key=most, reverse=True)


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, id=path.stem, marks=[pytest.mark.soak] if path.stem in SOAK else []) for path in LAUNCHES],
)
def test_rostest(path, repository, tmp_path):
    check(path, repository, tmp_path)


@pytest.mark.soak
@pytest.mark.parametrize("path", [pytest.param(path, id=path.stem) for path in LAUNCHES if path.stem not in SOAK])
def test_whole_rostest(path, repository, tmp_path):
    """With the tests that `system.soak` leaves out each day."""
    check(path, repository, tmp_path, SOAK="true")
